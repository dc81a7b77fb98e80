#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue {

/// A matrix is symmetric and given row by row; numbers are a list of 1 to 64.
enum class SettingType { kNumber, kInteger, kBool, kChoice, kAutoNumber, kVector3, kMatrix3, kNumbers };

/// A value of a setting: bool, integer, number, a choice (text), or the numbers of a vector, matrix or list. An
/// auto-number is the text "auto" or a number; a choice without choices is any text; null is what may be left out.
using SettingValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>, std::nullptr_t>;

/// One setting of a method or device, or one parameter of an effect, as data: one form builder draws them all and one
/// parser reads them all. Declared with the functions of declare.h.
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
  double plausible_min = 0.0;        ///< Of each number: what is met in practice; 0 and 0 = not told.
  double plausible_max = 0.0;

  bool isBounded() const { return min != 0.0 || max != 0.0; }
  bool hasPlausibleRange() const { return plausible_min != 0.0 || plausible_max != 0.0; }
  Setting plausibly(double low, double high) && {
    plausible_min = low;
    plausible_max = high;
    return std::move(*this);
  }
};

/// Whether a JSON value is one of the setting's: its type, its range, its choices. Null only where it may be left out.
bool accepts(const Setting& setting, const nlohmann::json& value);
/// What a valid value looks like: "an integer from 1 to 6".
std::string neededFor(const Setting& setting);
nlohmann::json toJson(const SettingValue& value);
/// A value as a person writes it: "auto", "0.3", "1 0 0"; empty for null.
std::string textOf(const SettingValue& value);
/// The inverse; none for what the setting does not accept.
std::optional<SettingValue> valueOf(const Setting& setting, std::string_view text);

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
