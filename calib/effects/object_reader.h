#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::effects {

/// The known name that takes the fewest single-letter changes (Levenshtein 1966), or of which only the end is missing;
/// empty when none is known.
std::string nearestName(std::string_view name, const std::vector<std::string>& known);

/// "x is not known; did you mean y? Known: y, z."
std::string unknownName(std::string_view name, const std::vector<std::string>& known);

/// What a JSON value is, in words for a message: "the text \"abc\"", "a list of 2".
std::string seenValue(const nlohmann::json& value);

/// Bounds of a number, both inclusive.
struct Bounds {
  double min = 0.0;
  double max = 0.0;
};

/// Reads one JSON object key by key into variables that already hold the defaults. The first thing that is wrong is
/// remembered, so the caller reads straight through and asks once at the end. The key `comment` is always ignored.
class ObjectReader {
 public:
  /// @param where stands before the key in messages: "lab.scene.json: tracker"; empty parts are left out
  ObjectReader(const nlohmann::json& object, std::string file, std::string path);

  void number(const std::string& key, double& value, Bounds bounds, const char* unit);
  void text(const std::string& key, std::string& value);
  /// @param choices the texts allowed
  void choice(const std::string& key, std::string& value, const std::vector<std::string>& choices);
  void vector3(const std::string& key, Eigen::Vector3d& value, double largest, const char* unit);
  /// [w, x, y, z], of norm 1 within 1 %; normalised.
  void quaternion(const std::string& key, Eigen::Quaterniond& value);
  /// The value of a key, or none; its content is checked by the caller.
  const nlohmann::json* value(const std::string& key);
  /// As `value`, and it must be an object (list).
  const nlohmann::json* object(const std::string& key);
  const nlohmann::json* list(const std::string& key);

  /// Refuses keys nobody asked for.
  /// @error kBadInput: the first thing wrong, naming file, key, what was seen and what is needed
  Result<void> finish() const;
  /// Path of a key as messages name it: "tracker.rate_hz".
  std::string pathOf(const std::string& key) const;

 private:
  void refuse(const std::string& key, const nlohmann::json& seen, const std::string& needed);
  const nlohmann::json& object_;
  std::string file_;
  std::string path_;
  std::vector<std::string> known_;
  std::optional<Error> error_;
};

}  // namespace fieldtrue::effects
