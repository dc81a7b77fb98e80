#include "calib/effects/object_reader.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/file_io.h"

namespace fieldtrue::effects {

namespace {

constexpr std::string_view kComment = "comment";

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

/// A name without its unit is one slip, however long the unit.
std::size_t slips(std::string_view name, std::string_view known) {
  const bool lacks_its_end = !name.empty() && known.starts_with(name);
  return lacks_its_end ? std::min<std::size_t>(1, known.size() - name.size()) : editDistance(name, known);
}

bool isFiniteNumber(const nlohmann::json& value) { return value.is_number() && std::isfinite(value.get<double>()); }

bool isNumberList(const nlohmann::json& value, std::size_t count) {
  return value.is_array() && value.size() == count && std::all_of(value.begin(), value.end(), isFiniteNumber);
}

std::string withUnit(const char* unit) { return *unit == '\0' ? std::string() : std::string(" [") + unit + "]"; }

}  // namespace

std::string nearestName(std::string_view name, const std::vector<std::string>& known) {
  const auto nearest = std::min_element(known.begin(), known.end(), [&](const std::string& a, const std::string& b) {
    return slips(name, a) < slips(name, b);
  });
  return nearest == known.end() ? std::string() : *nearest;
}

std::string unknownName(std::string_view name, const std::vector<std::string>& known) {
  std::string text(name);
  text += " is not known";
  if (known.empty()) return text + "; nothing is expected here.";
  text += "; did you mean " + nearestName(name, known) + "? Known:";
  for (std::size_t i = 0; i < known.size(); ++i) text += (i == 0 ? " " : ", ") + known[i];
  return text + ".";
}

std::string seenValue(const nlohmann::json& value) {
  if (value.is_null()) return "null";
  if (value.is_string()) return "the text \"" + value.get<std::string>() + "\"";
  if (value.is_object()) return "an object";
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number()) return formatNumber(value.get<double>());
  if (value.is_array() && value.size() <= 9) return value.dump();
  return "a list of " + std::to_string(value.size());
}

ObjectReader::ObjectReader(const nlohmann::json& object, std::string file, std::string path)
    : object_(object), file_(std::move(file)), path_(std::move(path)) {
  if (!object.is_object()) {
    error_ = Error{ErrorCode::kBadInput, file_ + ": " + (path_.empty() ? std::string("the file") : path_) +
                                             " must be an object {...}, got " + seenValue(object) + "."};
  }
}

std::string ObjectReader::pathOf(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

const nlohmann::json* ObjectReader::value(const std::string& key) {
  known_.push_back(key);
  if (error_) return nullptr;
  const auto found = object_.find(key);
  return found == object_.end() ? nullptr : &*found;
}

void ObjectReader::refuse(const std::string& key, const nlohmann::json& seen, const std::string& needed) {
  if (error_) return;
  error_ = Error{ErrorCode::kBadInput,
                 file_ + ": " + pathOf(key) + " is " + seenValue(seen) + "; it must be " + needed + "."};
}

void ObjectReader::number(const std::string& key, double& into, Bounds bounds, const char* unit) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr) return;
  if (isFiniteNumber(*seen) && seen->get<double>() >= bounds.min && seen->get<double>() <= bounds.max) {
    into = seen->get<double>();
    return;
  }
  refuse(key, *seen, "a number from " + formatNumber(bounds.min) + " to " + formatNumber(bounds.max) + withUnit(unit));
}

void ObjectReader::text(const std::string& key, std::string& into) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr) return;
  if (!seen->is_string()) return refuse(key, *seen, "a text");
  into = seen->get<std::string>();
}

void ObjectReader::choice(const std::string& key, std::string& into, const std::vector<std::string>& choices) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr) return;
  if (seen->is_string() && std::find(choices.begin(), choices.end(), seen->get<std::string>()) != choices.end()) {
    into = seen->get<std::string>();
    return;
  }
  std::string needed;
  for (const std::string& option : choices) needed += (needed.empty() ? "\"" : " or \"") + option + "\"";
  refuse(key, *seen, needed);
}

void ObjectReader::vector3(const std::string& key, Eigen::Vector3d& into, double largest, const char* unit) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr) return;
  const bool is_good = isNumberList(*seen, 3) && std::all_of(seen->begin(), seen->end(), [&](const nlohmann::json& x) {
                         return std::abs(x.get<double>()) <= largest;
                       });
  if (is_good) {
    for (int i = 0; i < 3; ++i) into[i] = (*seen)[static_cast<std::size_t>(i)].get<double>();
    return;
  }
  refuse(key, *seen, "three numbers of size up to " + formatNumber(largest) + withUnit(unit));
}

void ObjectReader::quaternion(const std::string& key, Eigen::Quaterniond& into) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr) return;
  if (isNumberList(*seen, 4)) {
    const Eigen::Quaterniond q((*seen)[0].get<double>(), (*seen)[1].get<double>(), (*seen)[2].get<double>(),
                               (*seen)[3].get<double>());
    if (std::abs(q.norm() - 1.0) < 0.01) {
      // A quaternion we wrote ourselves is unit to rounding and must read back to the same bits.
      into = std::abs(q.norm() - 1.0) < 1e-14 ? q : q.normalized();
      return;
    }
  }
  refuse(key, *seen, "four numbers [w, x, y, z] of a unit quaternion");
}

const nlohmann::json* ObjectReader::object(const std::string& key) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr || seen->is_object()) return seen;
  refuse(key, *seen, "an object {...}");
  return nullptr;
}

const nlohmann::json* ObjectReader::list(const std::string& key) {
  const nlohmann::json* seen = value(key);
  if (seen == nullptr || seen->is_array()) return seen;
  refuse(key, *seen, "a list [...]");
  return nullptr;
}

Result<void> ObjectReader::finish() const {
  if (error_) return tl::unexpected<Error>(*error_);
  for (const auto& [key, unused] : object_.items()) {
    if (key == kComment || std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    return fail(ErrorCode::kBadInput,
                file_ + ": " + pathOf(key).substr(0, pathOf(key).size() - key.size()) + unknownName(key, known_));
  }
  return {};
}

}  // namespace fieldtrue::effects
