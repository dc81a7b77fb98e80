#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "calib/effects/object_reader.h"

namespace fieldtrue::gap {

/// One value of a JSON document and the path that leads to it. The first thing that is wrong anywhere in the document
/// is remembered, so a reader goes straight through and asks once at the end; until then a wrong value reads as a
/// default.
class JsonCursor {
 public:
  /// @param problem receives the sentence about the first thing wrong; empty before
  JsonCursor(const nlohmann::json& document, std::string& problem) : JsonCursor(&document, "", &problem) {}

  JsonCursor operator[](const char* key) const {
    const std::string path = path_.empty() ? key : path_ + "." + key;
    if (value_ == nullptr) return {nullptr, path, problem_};
    if (!value_->is_object()) return refuse("an object"), JsonCursor(nullptr, path, problem_);
    const auto found = value_->find(key);
    if (found != value_->end()) return {&*found, path, problem_};
    remember(path + " is missing");
    return {nullptr, path, problem_};
  }

  bool isNull() const { return value_ == nullptr || value_->is_null(); }

  /// NaN for null: what could not be estimated.
  double number() const { return optionalNumber().value_or(std::numeric_limits<double>::quiet_NaN()); }

  std::optional<double> optionalNumber() const {
    if (isNull()) return std::nullopt;
    if (!value_->is_number()) return refuse("a number or null"), std::nullopt;
    return value_->get<double>();
  }

  int integer() const {
    if (value_ == nullptr) return 0;
    const double number = value_->is_number() ? value_->get<double>() : 0.5;
    const bool is_whole = std::abs(number) <= std::numeric_limits<int>::max() && number == std::floor(number);
    return is_whole ? static_cast<int>(number) : (refuse("a whole number"), 0);
  }

  bool flag() const {
    if (value_ == nullptr) return false;
    return value_->is_boolean() ? value_->get<bool>() : (refuse("true or false"), false);
  }

  std::string text() const {
    if (value_ == nullptr) return {};
    return value_->is_string() ? value_->get<std::string>() : (refuse("a text"), std::string());
  }

  std::optional<std::string> optionalText() const { return isNull() ? std::nullopt : std::optional(text()); }

  Eigen::Vector3d vector3(double factor = 1.0) const {
    const std::vector<double> components = list([](const JsonCursor& component) { return component.number(); });
    if (components.size() == 3) return factor * Eigen::Vector3d(components.data());
    if (value_ != nullptr) refuse("a list of 3 numbers");
    return Eigen::Vector3d::Zero();
  }

  std::vector<int> integers() const {
    return list([](const JsonCursor& item) { return item.integer(); });
  }

  std::vector<std::string> texts() const {
    return list([](const JsonCursor& item) { return item.text(); });
  }

  /// Every entry of a list, read by `read(const JsonCursor&)`.
  template <class Read>
  std::vector<std::invoke_result_t<Read, JsonCursor>> list(Read read) const {
    std::vector<std::invoke_result_t<Read, JsonCursor>> items;
    if (value_ == nullptr) return items;
    if (!value_->is_array()) {
      refuse("a list");
      return items;
    }
    for (std::size_t i = 0; i < value_->size(); ++i) {
      items.push_back(read(JsonCursor(&(*value_)[i], path_ + "[" + std::to_string(i) + "]", problem_)));
    }
    return items;
  }

  /// The value as it is; null when it is missing.
  nlohmann::json raw() const { return value_ == nullptr ? nlohmann::json() : *value_; }

  /// Remembers that the value is not what is needed.
  void refuse(const std::string& needed) const {
    if (value_ != nullptr) remember(path_ + " is " + effects::seenValue(*value_) + "; it must be " + needed);
  }

 private:
  JsonCursor(const nlohmann::json* value, std::string path, std::string* problem)
      : value_(value), path_(std::move(path)), problem_(problem) {}

  void remember(const std::string& sentence) const {
    if (problem_->empty()) *problem_ = sentence;
  }

  const nlohmann::json* value_;
  std::string path_;
  std::string* problem_;
};

}  // namespace fieldtrue::gap
