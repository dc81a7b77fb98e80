#include "calib/core/json_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "calib/core/file_io.h"
#include "calib/core/nearest_name.h"

namespace fieldtrue {

namespace {

constexpr std::string_view kComment = "comment";

bool isFiniteNumber(const nlohmann::json& value) { return value.is_number() && std::isfinite(value.get<double>()); }

bool isNumberList(const nlohmann::json& value, std::size_t count) {
  return value.is_array() && value.size() == count && std::all_of(value.begin(), value.end(), isFiniteNumber);
}

std::string withUnit(const std::string& unit) { return unit.empty() ? unit : " [" + unit + "]"; }

std::string quotedChoices(const std::vector<std::string>& choices) {
  std::string text;
  for (const std::string& choice : choices) text += (text.empty() ? "\"" : " or \"") + choice + "\"";
  return text;
}

/// Printed whole where it is short; text that is not UTF-8 with replacement characters.
std::string printed(const nlohmann::json& value) {
  constexpr std::size_t kLongest = 60;
  const std::string text = value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "...";
}

}  // namespace

std::string seenValue(const nlohmann::json& value) {
  if (value.is_null()) return "null";
  if (value.is_string()) return "the text " + printed(value);
  if (value.is_object()) return "an object";
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number()) return formatNumber(value.get<double>());
  if (value.is_array() && value.size() <= 9) return printed(value);
  return "a list of " + std::to_string(value.size());
}

JsonReader::JsonReader(const nlohmann::json& document, std::string name)
    : value_(&document), document_(std::move(name)) {}

JsonReader::JsonReader(const JsonReader& parent, const nlohmann::json& value, std::string path)
    : value_(&value), document_(parent.document_), path_(std::move(path)) {}

void JsonReader::fail(const std::string& what, ErrorCode code) const {
  throw JsonProblem{code, document_ + ": " + (path_.empty() ? "" : path_ + " ") + what};
}

void JsonReader::fail(const Error& error) const {
  throw JsonProblem{error.code, document_ + ": " + (path_.empty() ? "" : path_ + ": ") + error.message};
}

void JsonReader::refuse(const std::string& needed) const {
  const std::string it = path_.empty() ? "the file is " : "is ";
  fail(it + seenValue(*value_) + "; it must be " + needed + ".");
}

std::optional<JsonReader> JsonReader::find(const std::string& key) const {
  const nlohmann::json& object = this->object();
  if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) asked_.push_back(key);
  const auto found = object.find(key);
  if (found == object.end()) return std::nullopt;
  return JsonReader(*this, *found, pathOf(key));
}

JsonReader JsonReader::operator[](const std::string& key) const {
  if (auto found = find(key)) return *std::move(found);
  throw JsonProblem{ErrorCode::kBadInput, document_ + ": " + pathOf(key) + " is missing."};
}

void JsonReader::refuseOtherKeys() const {
  for (const auto& [key, unused] : object().items()) {
    if (key == kComment || std::find(asked_.begin(), asked_.end(), key) != asked_.end()) continue;
    throw JsonProblem{ErrorCode::kBadInput,
                      document_ + ": " + (path_.empty() ? "" : path_ + ".") + unknownName(key, asked_)};
  }
}

std::optional<int> JsonReader::schema(std::string_view kind, int newest, const std::string& article_and_name) const {
  const auto found = value_->is_object() ? find("schema") : std::nullopt;
  if (!found) return std::nullopt;
  const std::string known = std::string(kind) + std::to_string(newest);
  const std::string text = found->value_->is_string() ? found->text() : std::string();
  int version = 0;
  if (text.starts_with(kind)) {
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + kind.size(), end, version);
    if (error != std::errc() || rest != end) version = 0;
  }
  if (version < 1) {
    throw JsonProblem{ErrorCode::kBadInput, document_ + " is not " + article_and_name + ": schema is " +
                                                seenValue(found->raw()) + ", and " + article_and_name + " has \"" +
                                                known + "\"."};
  }
  if (version > newest) {
    found->fail("is \"" + text + "\", written by a newer version of Fieldtrue; this one reads " + known + ".",
                ErrorCode::kNewerVersion);
  }
  return version;
}

bool JsonReader::isNull() const { return value_->is_null(); }

bool JsonReader::isNumber() const { return isFiniteNumber(*value_); }

double JsonReader::number() const {
  if (!isNumber()) refuse("a number");
  return value_->get<double>();
}

double JsonReader::number(Bounds bounds, const std::string& unit) const {
  const double number = isNumber() ? value_->get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (number >= bounds.min && number <= bounds.max) return number;
  refuse("a number from " + formatNumber(bounds.min) + " to " + formatNumber(bounds.max) + withUnit(unit));
}

int JsonReader::integer() const {
  return static_cast<int>(integer(std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
}

std::int64_t JsonReader::integer(std::int64_t min, std::int64_t max) const {
  // Exact: every whole number that a double holds and that lies in the range of 64 bits.
  constexpr double kLargest = 9007199254740992.0;
  const double number = value_->is_number() ? value_->get<double>() : 0.5;
  if (number == std::floor(number) && std::abs(number) <= kLargest) {
    const auto whole = static_cast<std::int64_t>(number);
    if (whole >= min && whole <= max) return whole;
  }
  const bool is_any = min == std::numeric_limits<int>::min() && max == std::numeric_limits<int>::max();
  refuse("a whole number" + (is_any ? std::string() : " from " + std::to_string(min) + " to " + std::to_string(max)));
}

bool JsonReader::flag() const {
  if (!value_->is_boolean()) refuse("true or false");
  return value_->get<bool>();
}

std::string JsonReader::text() const {
  if (!value_->is_string()) refuse("a text");
  return value_->get<std::string>();
}

std::string JsonReader::oneOf(const std::vector<std::string>& choices) const {
  const bool is_known = value_->is_string() && std::find(choices.begin(), choices.end(), text()) != choices.end();
  if (!is_known) refuse(quotedChoices(choices));
  return text();
}

std::optional<double> JsonReader::optionalNumber() const {
  if (isNull()) return std::nullopt;
  if (!isNumber()) refuse("a number or null");
  return value_->get<double>();
}

double JsonReader::numberOrNan() const { return optionalNumber().value_or(std::numeric_limits<double>::quiet_NaN()); }

std::optional<std::string> JsonReader::optionalText() const { return isNull() ? std::nullopt : std::optional(text()); }

void JsonReader::needList(std::optional<std::size_t> size, const std::string& needed) const {
  if (!value_->is_array() || (size && value_->size() != *size)) refuse(needed);
}

const nlohmann::json& JsonReader::object() const {
  if (!value_->is_object()) refuse("an object {...}");
  return *value_;
}

std::vector<JsonReader> JsonReader::entries() const {
  needList(std::nullopt, "a list [...]");
  std::vector<JsonReader> entries;
  entries.reserve(value_->size());
  for (std::size_t i = 0; i < value_->size(); ++i)
    entries.push_back(JsonReader(*this, (*value_)[i], path_ + "[" + std::to_string(i) + "]"));
  return entries;
}

std::vector<double> JsonReader::numbers() const {
  needList(std::nullopt, "a list of numbers");
  if (!isNumberList(*value_, value_->size())) refuse("a list of numbers only");
  return value_->get<std::vector<double>>();
}

std::vector<int> JsonReader::integers() const {
  return list([](const JsonReader& entry) { return entry.integer(); });
}

std::array<int, 3> JsonReader::integers3() const {
  needList(3, "a list of 3 whole numbers");
  const std::vector<int> numbers = integers();
  return {numbers[0], numbers[1], numbers[2]};
}

std::vector<std::string> JsonReader::texts() const {
  return list([](const JsonReader& entry) { return entry.text(); });
}

std::map<std::string, std::string> JsonReader::namedTexts() const {
  std::map<std::string, std::string> texts;
  for (const auto& [key, value] : object().items()) texts[key] = JsonReader(*this, value, pathOf(key)).text();
  return texts;
}

Eigen::Vector3d JsonReader::vector3() const {
  if (!isNumberList(*value_, 3)) refuse("a list of 3 numbers");
  return {(*value_)[0].get<double>(), (*value_)[1].get<double>(), (*value_)[2].get<double>()};
}

Eigen::Vector3d JsonReader::vector3(double largest, const std::string& unit) const {
  if (!isNumberList(*value_, 3) || vector3().cwiseAbs().maxCoeff() > largest)
    refuse("three numbers of size up to " + formatNumber(largest) + withUnit(unit));
  return vector3();
}

Eigen::Quaterniond JsonReader::quaternion() const {
  if (isNumberList(*value_, 4)) {
    const Eigen::Quaterniond q((*value_)[0].get<double>(), (*value_)[1].get<double>(), (*value_)[2].get<double>(),
                               (*value_)[3].get<double>());
    // A quaternion we wrote ourselves is unit to rounding and must read back to the same bits.
    if (std::abs(q.norm() - 1.0) < 1e-14) return q;
    if (std::abs(q.norm() - 1.0) < 0.01) return q.normalized();
  }
  refuse("four numbers [w, x, y, z] of a unit quaternion");
}

Pose JsonReader::pose() const { return {(*this)["t_m"].vector3(), (*this)["q_wxyz"].quaternion()}; }

Eigen::MatrixXd JsonReader::matrix(Eigen::Index columns) const {
  needList(std::nullopt, "a list of rows");
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(value_->size()), columns);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const nlohmann::json& row = (*value_)[static_cast<std::size_t>(i)];
    if (!isNumberList(row, static_cast<std::size_t>(columns)))
      fail("has the row " + printed(row) + "; a row must be " + std::to_string(columns) + " numbers.");
    for (Eigen::Index j = 0; j < columns; ++j) matrix(i, j) = row[static_cast<std::size_t>(j)].get<double>();
  }
  return matrix;
}

Eigen::Matrix3d JsonReader::matrix3() const {
  needList(3, "a list of 3 rows");
  return matrix(3);
}

void JsonReader::number(const std::string& key, double& value, Bounds bounds, const std::string& unit) const {
  if (const auto found = find(key)) value = found->number(bounds, unit);
}

void JsonReader::text(const std::string& key, std::string& value) const {
  if (const auto found = find(key)) value = found->text();
}

void JsonReader::oneOf(const std::string& key, std::string& value, const std::vector<std::string>& choices) const {
  if (const auto found = find(key)) value = found->oneOf(choices);
}

void JsonReader::vector3(const std::string& key, Eigen::Vector3d& value, double largest,
                         const std::string& unit) const {
  if (const auto found = find(key)) value = found->vector3(largest, unit);
}

void JsonReader::quaternion(const std::string& key, Eigen::Quaterniond& value) const {
  if (const auto found = find(key)) value = found->quaternion();
}

nlohmann::json jsonOf(const Eigen::Vector3d& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); }

nlohmann::json jsonOf(const Eigen::Quaterniond& q) { return nlohmann::json::array({q.w(), q.x(), q.y(), q.z()}); }

nlohmann::json jsonOf(const Pose& pose) {
  return {{"t_m", jsonOf(pose.position_m)}, {"q_wxyz", jsonOf(pose.orientation)}};
}

nlohmann::json jsonOf(const Eigen::MatrixXd& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace fieldtrue
