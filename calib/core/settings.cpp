#include "calib/core/settings.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "calib/core/file_io.h"
#include "calib/core/trimmed.h"

namespace fieldtrue {

namespace {

/// The whole of a text as a number.
template <class Number>
std::optional<Number> numberFrom(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

bool inRange(const Setting& setting, double value) {
  return std::isfinite(value) && (!setting.isBounded() || (value >= setting.min && value <= setting.max));
}

constexpr std::size_t kLongestList = 64;

bool areNumbers(const Setting& setting, const nlohmann::json& value, std::size_t count) {
  return value.is_array() && value.size() == count &&
         std::all_of(value.begin(), value.end(), [&](const nlohmann::json& entry) {
           return entry.is_number() && inRange(setting, entry.get<double>());
         });
}

/// Figures rounded to six digits still pass.
bool isSymmetric(const nlohmann::json& flat) {
  double largest = 0.0;
  for (const nlohmann::json& entry : flat) largest = std::max(largest, std::abs(entry.get<double>()));
  const auto differs = [&](std::size_t a, std::size_t b) {
    return std::abs(flat[a].get<double>() - flat[b].get<double>()) > 1e-6 * largest;
  };
  return !differs(1, 3) && !differs(2, 6) && !differs(5, 7);
}

bool isChoice(const Setting& setting, std::string_view text) {
  return setting.choices.empty() ||
         std::find(setting.choices.begin(), setting.choices.end(), text) != setting.choices.end();
}

std::optional<bool> parseBool(std::string_view text) {
  for (const std::string_view yes : {"true", "yes", "on", "1"}) {
    if (text == yes) return true;
  }
  for (const std::string_view no : {"false", "no", "off", "0"}) {
    if (text == no) return false;
  }
  return std::nullopt;
}

std::optional<nlohmann::json> parseNumbers(std::string_view text) {
  nlohmann::json numbers = nlohmann::json::array();
  while (!(text = trimmed(text)).empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::optional<double> number = numberFrom<double>(text.substr(0, end));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    text.remove_prefix(end);
  }
  return numbers;
}

/// What a text says, not yet checked.
std::optional<nlohmann::json> jsonFrom(const Setting& setting, std::string_view text) {
  const auto json = [](const auto& parsed) { return parsed ? std::optional<nlohmann::json>(*parsed) : std::nullopt; };
  switch (setting.type) {
    case SettingType::kBool:
      return json(parseBool(text));
    case SettingType::kInteger:
      return json(numberFrom<std::int64_t>(text));
    case SettingType::kAutoNumber:
      if (text == "auto") return text;
      return json(numberFrom<double>(text));
    case SettingType::kNumber:
      return json(numberFrom<double>(text));
    case SettingType::kChoice:
      return text;
    case SettingType::kVector3:
    case SettingType::kMatrix3:
    case SettingType::kNumbers:
      return parseNumbers(text);
  }
  return std::nullopt;
}

/// A default written as `1` where the setting is a number means 1.0.
SettingValue defaultOf(const Setting& setting) {
  const bool is_number = setting.type == SettingType::kNumber || setting.type == SettingType::kAutoNumber;
  if (const auto* integer = std::get_if<std::int64_t>(&setting.default_value); integer && is_number) {
    return static_cast<double>(*integer);
  }
  return setting.default_value;
}

const Setting* findSetting(std::span<const Setting> declared, std::string_view key) {
  const auto found = std::find_if(declared.begin(), declared.end(), [&](const Setting& s) { return s.key == key; });
  return found == declared.end() ? nullptr : &*found;
}

tl::unexpected<Error> unknownKey(std::string_view owner, std::span<const Setting> declared, const std::string& key) {
  std::vector<std::string> known;
  for (const Setting& setting : declared) known.push_back(setting.key);
  return fail(ErrorCode::kBadInput, std::string(owner) + " has no setting '" + key + "'; " +
                                        (known.empty() ? "it has none" : "its settings are " + joined(known)));
}

tl::unexpected<Error> badValue(std::string_view owner, const Setting& setting, const std::string& seen) {
  return fail(ErrorCode::kBadInput,
              std::string(owner) + ": " + setting.key + " must be " + neededFor(setting) + ", got '" + seen + "'");
}

/// The value of accepted JSON.
SettingValue valueFrom(const Setting& setting, const nlohmann::json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_string()) return json.get<std::string>();
  if (json.is_null()) return nullptr;
  if (json.is_array()) return json.get<std::vector<double>>();
  if (setting.type == SettingType::kInteger) return json.get<std::int64_t>();
  return json.get<double>();
}

template <class Value>
const Value& typedSetting(const Settings& settings, const std::string& key) {
  const auto found = settings.find(key);
  FT_CHECK(found != settings.end());
  const Value* value = std::get_if<Value>(&found->second);
  FT_CHECK(value != nullptr);
  return *value;
}

const char* nameOf(SettingType type) {
  switch (type) {
    case SettingType::kNumber:
      return "number";
    case SettingType::kInteger:
      return "integer";
    case SettingType::kBool:
      return "bool";
    case SettingType::kChoice:
      return "choice";
    case SettingType::kAutoNumber:
      return "auto_number";
    case SettingType::kVector3:
      return "vector3";
    case SettingType::kMatrix3:
      return "matrix3";
    case SettingType::kNumbers:
      return "list";
  }
  return "";
}

struct ValueText {
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return formatNumber(value); }
  std::string operator()(const std::string& value) const { return value; }
  std::string operator()(std::nullptr_t) const { return {}; }
  std::string operator()(const std::vector<double>& values) const {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : " ") + formatNumber(value);
    return text;
  }
};

}  // namespace

bool accepts(const Setting& setting, const nlohmann::json& value) {
  if (value.is_null()) return std::holds_alternative<std::nullptr_t>(setting.default_value);
  switch (setting.type) {
    case SettingType::kNumber:
      return value.is_number() && inRange(setting, value.get<double>());
    case SettingType::kInteger:
      return value.is_number_integer() && inRange(setting, value.get<double>());
    case SettingType::kBool:
      return value.is_boolean();
    case SettingType::kAutoNumber:
      if (value.is_number() && setting.whole && value.get<double>() != std::floor(value.get<double>())) return false;
      return value == "auto" || (value.is_number() && inRange(setting, value.get<double>()));
    case SettingType::kChoice:
      return value.is_string() && isChoice(setting, value.get_ref<const std::string&>());
    case SettingType::kVector3:
      return areNumbers(setting, value, 3);
    case SettingType::kMatrix3:
      return areNumbers(setting, value, 9) && isSymmetric(value);
    case SettingType::kNumbers:
      return !value.empty() && value.size() <= kLongestList && areNumbers(setting, value, value.size());
  }
  return false;
}

std::string neededFor(const Setting& setting) {
  const std::string range =
      setting.isBounded() ? " from " + formatNumber(setting.min) + " to " + formatNumber(setting.max) : "";
  const std::string unit = setting.unit.empty() ? "" : " [" + setting.unit + "]";
  switch (setting.type) {
    case SettingType::kNumber:
      return "a number" + range + unit;
    case SettingType::kInteger:
      return "a whole number" + range + unit;
    case SettingType::kBool:
      return "true or false";
    case SettingType::kAutoNumber:
      return (setting.whole ? "auto or a whole number" : "auto or a number") + range + unit;
    case SettingType::kChoice:
      return setting.choices.empty() ? "a text" : "one of " + joined(setting.choices);
    case SettingType::kVector3:
      return "three numbers" + range + unit;
    case SettingType::kMatrix3:
      return "nine numbers of a symmetric matrix, row by row," + range + unit;
    case SettingType::kNumbers:
      return "a list of 1 to " + std::to_string(kLongestList) + " numbers" + range + unit;
  }
  return {};
}

nlohmann::json toJson(const SettingValue& value) {
  return std::visit([](const auto& held) { return nlohmann::json(held); }, value);
}

std::string textOf(const SettingValue& value) { return std::visit(ValueText(), value); }

std::optional<SettingValue> valueOf(const Setting& setting, std::string_view text) {
  const std::optional<nlohmann::json> json = jsonFrom(setting, text);
  return json && accepts(setting, *json) ? std::optional(valueFrom(setting, *json)) : std::nullopt;
}

Result<MethodText> parseMethodText(std::string_view text) {
  const std::size_t colon = text.find(':');
  MethodText method{std::string(trimmed(text.substr(0, colon))), {}};
  if (method.id.empty()) {
    return fail(ErrorCode::kBadInput,
                "A method is written id or id:key=value,key=value, got '" + std::string(text) + "'");
  }
  if (colon == std::string_view::npos) return method;
  std::string_view rest = text.substr(colon + 1);
  while (true) {
    const std::size_t comma = rest.find(',');
    const std::string_view part = rest.substr(0, comma);
    const std::size_t equals = part.find('=');
    const std::string key(trimmed(part.substr(0, equals)));
    if (equals == std::string_view::npos || key.empty()) {
      return fail(ErrorCode::kBadInput,
                  "A setting of " + method.id + " is written key=value, got '" + std::string(part) + "'");
    }
    if (!method.given.emplace(key, trimmed(part.substr(equals + 1))).second) {
      return fail(ErrorCode::kBadInput, "Setting " + key + " of " + method.id + " is given twice");
    }
    if (comma == std::string_view::npos) return method;
    rest.remove_prefix(comma + 1);
  }
}

Result<Settings> resolveSettings(std::string_view owner, std::span<const Setting> declared,
                                 const std::map<std::string, std::string>& given) {
  Settings settings;
  for (const Setting& setting : declared) settings[setting.key] = defaultOf(setting);
  for (const auto& [key, text] : given) {
    const Setting* setting = findSetting(declared, key);
    if (setting == nullptr) return unknownKey(owner, declared, key);
    const std::optional<SettingValue> value = valueOf(*setting, text);
    if (!value) return badValue(owner, *setting, text);
    settings[key] = *value;
  }
  return settings;
}

double numberSetting(const Settings& settings, const std::string& key) { return typedSetting<double>(settings, key); }

std::int64_t integerSetting(const Settings& settings, const std::string& key) {
  return typedSetting<std::int64_t>(settings, key);
}

bool boolSetting(const Settings& settings, const std::string& key) { return typedSetting<bool>(settings, key); }

const std::string& choiceSetting(const Settings& settings, const std::string& key) {
  return typedSetting<std::string>(settings, key);
}

nlohmann::json toJson(const Settings& settings) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [key, value] : settings) json[key] = toJson(value);
  return json;
}

nlohmann::json toJson(std::span<const Setting> declared) {
  nlohmann::json json = nlohmann::json::array();
  for (const Setting& setting : declared) {
    nlohmann::json row = {{"key", setting.key},   {"label", setting.label},
                          {"unit", setting.unit}, {"type", nameOf(setting.type)},
                          {"help", setting.help}, {"default", toJson(defaultOf(setting))}};
    row["min"] = setting.isBounded() ? nlohmann::json(setting.min) : nlohmann::json();
    row["max"] = setting.isBounded() ? nlohmann::json(setting.max) : nlohmann::json();
    if (setting.type == SettingType::kChoice) row["choices"] = setting.choices;
    json.push_back(std::move(row));
  }
  return json;
}

Result<Settings> settingsFromJson(std::string_view owner, std::span<const Setting> declared,
                                  const nlohmann::json& json) {
  if (!json.is_object()) return fail(ErrorCode::kBadInput, std::string(owner) + ": settings must be a JSON object");
  Settings settings;
  for (const Setting& setting : declared) {
    const auto found = json.find(setting.key);
    if (found == json.end()) {
      return fail(ErrorCode::kBadInput, std::string(owner) + ": setting " + setting.key + " is missing");
    }
    if (!accepts(setting, *found)) return badValue(owner, setting, found->dump());
    settings[setting.key] = valueFrom(setting, *found);
  }
  for (const auto& [key, value] : json.items()) {
    if (findSetting(declared, key) == nullptr) return unknownKey(owner, declared, key);
  }
  return settings;
}

}  // namespace fieldtrue
