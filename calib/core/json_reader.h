#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"

namespace fieldtrue {

/// What a JSON value is, in words for a message: "the text \"abc\"", "a list of 2".
std::string seenValue(const nlohmann::json& value);

/// Bounds of a number, both inclusive.
struct Bounds {
  double min = 0.0;
  double max = 0.0;
};

/// The first thing wrong in a document. Thrown by JsonReader, and by nothing else; `readJson` makes an Error of it.
struct JsonProblem {
  ErrorCode code = ErrorCode::kBadInput;
  std::string sentence;
};

/// One value of a JSON document that came from outside, and the path that leads to it: "tracker.rate_hz",
/// "nodes[3].x_m". Every member that reads throws JsonProblem when the value is not what it must be, so a reader goes
/// straight through; it is called by `readJson`. The key `comment` is allowed in every object.
class JsonReader {
 public:
  /// @param name of the document, for messages
  JsonReader(const nlohmann::json& document, std::string name);

  /// The value of a key that must be there.
  JsonReader operator[](const std::string& key) const;
  /// The value of a key that may be left out. Null counts as a value.
  std::optional<JsonReader> find(const std::string& key) const;
  bool has(const std::string& key) const { return find(key).has_value(); }
  /// Refuses keys of this object that have not been asked for.
  void refuseOtherKeys() const;

  /// Of the key `schema`, "KIND/VERSION"; none where it is missing. A newer version is kNewerVersion.
  /// @param article_and_name for messages: "a scene"
  std::optional<int> schema(std::string_view kind, int newest, const std::string& article_and_name) const;

  bool isNull() const;
  bool isNumber() const;
  double number() const;
  /// @param unit for messages; empty when dimensionless
  double number(Bounds bounds, const std::string& unit) const;
  int integer() const;
  std::int64_t integer(std::int64_t min, std::int64_t max) const;
  bool flag() const;
  std::string text() const;
  std::string oneOf(const std::vector<std::string>& choices) const;
  /// None for null: what could not be estimated.
  std::optional<double> optionalNumber() const;
  /// NaN for null.
  double numberOrNan() const;
  std::optional<std::string> optionalText() const;

  std::vector<double> numbers() const;
  std::vector<int> integers() const;
  std::array<int, 3> integers3() const;
  std::vector<std::string> texts() const;
  /// Of an object: every key with its text.
  std::map<std::string, std::string> namedTexts() const;
  Eigen::Vector3d vector3() const;
  Eigen::Vector3d vector3(double largest, const std::string& unit) const;
  /// [w, x, y, z], of norm 1 within 1 %; normalised.
  Eigen::Quaterniond quaternion() const;
  /// {"t_m": [3], "q_wxyz": [4]}
  Pose pose() const;
  /// Rows of so many numbers each.
  Eigen::MatrixXd matrix(Eigen::Index columns) const;
  Eigen::Matrix3d matrix3() const;

  /// The value, which must be an object.
  const nlohmann::json& object() const;
  /// Entries of a list.
  std::vector<JsonReader> entries() const;
  /// Every entry of a list, read by `read(const JsonReader&)`.
  template <class Read>
  std::vector<std::invoke_result_t<Read, const JsonReader&>> list(Read read) const {
    std::vector<std::invoke_result_t<Read, const JsonReader&>> items;
    for (const JsonReader& entry : entries()) items.push_back(read(entry));
    return items;
  }

  /// Read into a variable that already holds the default, which stays where the key is missing.
  void number(const std::string& key, double& value, Bounds bounds, const std::string& unit) const;
  void text(const std::string& key, std::string& value) const;
  void oneOf(const std::string& key, std::string& value, const std::vector<std::string>& choices) const;
  void vector3(const std::string& key, Eigen::Vector3d& value, double largest, const std::string& unit) const;
  void quaternion(const std::string& key, Eigen::Quaterniond& value) const;

  const nlohmann::json& raw() const { return *value_; }
  const std::string& path() const { return path_; }
  /// The value must be something else. @param needed completes "it must be ..."
  [[noreturn]] void refuse(const std::string& needed) const;
  /// Something else is wrong here. @param what completes the path
  [[noreturn]] void fail(const std::string& what, ErrorCode code = ErrorCode::kBadInput) const;
  /// What was made of the value ended with an error, which is told as that of this place.
  [[noreturn]] void fail(const Error& error) const;
  /// What was made of the value, or its error.
  template <class T>
  T valueOf(Result<T> made) const {
    if (!made) fail(made.error());
    return *std::move(made);
  }

 private:
  JsonReader(const JsonReader& parent, const nlohmann::json& value, std::string path);
  std::string pathOf(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  void needList(std::optional<std::size_t> size, const std::string& needed) const;

  const nlohmann::json* value_;
  std::string document_;
  std::string path_;
  mutable std::vector<std::string> asked_;
};

/// Runs a reader over a document.
/// @param read called with the document's JsonReader; gives a T or a Result<T>
/// @error of the first thing wrong: "lab.scene.json: tracker.rate_hz is "fast"; it must be a number from 0.1 to 10000
///        [Hz].", and what `read` returns
template <class T, class Read>
Result<T> readJson(const nlohmann::json& document, const std::string& name, Read read) {
  try {
    return read(JsonReader(document, name));
  } catch (const JsonProblem& problem) {
    return tl::unexpected<Error>(Error{problem.code, problem.sentence});
  }
}

/// Vectors and matrices as JSON arrays of numbers. A double is written with enough digits to read back to the same
/// bits.
nlohmann::json jsonOf(const Eigen::Vector3d& v);
/// Scalar first: [w, x, y, z].
nlohmann::json jsonOf(const Eigen::Quaterniond& q);
/// {"t_m": [3], "q_wxyz": [4]}
nlohmann::json jsonOf(const Pose& pose);
/// Rows as arrays.
nlohmann::json jsonOf(const Eigen::MatrixXd& matrix);

}  // namespace fieldtrue
