#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue {

enum class SettingType { kNumber, kInteger, kBool, kChoice, kAutoNumber };

/// A value of a setting: bool, integer, number, or a choice (text). An auto-number is the text "auto" or a number; a
/// choice without choices is any text.
using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

/// One setting as data: one form builder draws them all and one parser reads them all.
struct Setting {
  std::string key;
  std::string label;
  SettingType type = SettingType::kNumber;
  std::string unit;  ///< Empty when dimensionless.
  double min = 0.0;  ///< min and max both 0: any finite number.
  double max = 0.0;
  SettingValue default_value = 0.0;
  std::vector<std::string> choices;  ///< For kChoice; empty = any text.
  std::string help;                  ///< One sentence.
  bool whole = false;                ///< An auto-number that takes whole numbers only.
};

/// Resolved values, one for every declared key.
using Settings = std::map<std::string, SettingValue>;

/// What a person wrote: `id` or `id:key=value,key=value`.
struct MethodText {
  std::string id;
  std::map<std::string, std::string> given;
};

/// Splits `id:key=value,...`.
/// @error kBadInput when the text is empty or a part has no '='
Result<MethodText> parseMethodText(std::string_view text);

/// Checks given values against the declarations and fills in the defaults.
/// @param owner named in messages, e.g. "polynomial"
/// @error kBadInput for an unknown key (the known ones are listed), a value of the wrong type or out of range
Result<Settings> resolveSettings(std::string_view owner, std::span<const Setting> declared,
                                 const std::map<std::string, std::string>& given);

/// Typed access; the key must exist and have that type (FT_CHECK).
double numberSetting(const Settings& settings, const std::string& key);
std::int64_t integerSetting(const Settings& settings, const std::string& key);
bool boolSetting(const Settings& settings, const std::string& key);
const std::string& choiceSetting(const Settings& settings, const std::string& key);

nlohmann::json toJson(const Settings& settings);
nlohmann::json toJson(std::span<const Setting> declared);
/// @error kBadInput when the JSON does not hold a valid value for every declared setting
Result<Settings> settingsFromJson(std::string_view owner, std::span<const Setting> declared,
                                  const nlohmann::json& json);

}  // namespace fieldtrue
