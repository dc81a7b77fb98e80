#include "calib/core/settings.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "calib/core/file_io.h"

namespace fieldtrue {

namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

template <class Number>
std::optional<Number> wholeNumber(std::string_view text) {
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

bool isBounded(const Setting& setting) { return setting.min != 0.0 || setting.max != 0.0; }

bool inRange(const Setting& setting, double value) {
  return std::isfinite(value) && (!isBounded(setting) || (value >= setting.min && value <= setting.max));
}

/// What a valid value looks like: "an integer from 1 to 6".
std::string needed(const Setting& setting) {
  const std::string range =
      isBounded(setting) ? " from " + formatNumber(setting.min) + " to " + formatNumber(setting.max) : "";
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
  }
  return {};
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

std::optional<SettingValue> parseNumber(const Setting& setting, std::string_view text) {
  const std::optional<double> value = wholeNumber<double>(text);
  if (!value || !inRange(setting, *value)) return std::nullopt;
  if (setting.whole && *value != std::floor(*value)) return std::nullopt;
  return SettingValue(*value);
}

bool isChoice(const Setting& setting, std::string_view text) {
  return setting.choices.empty() ||
         std::find(setting.choices.begin(), setting.choices.end(), text) != setting.choices.end();
}

std::optional<SettingValue> parseValue(const Setting& setting, std::string_view text) {
  switch (setting.type) {
    case SettingType::kBool:
      if (const auto value = parseBool(text)) return SettingValue(*value);
      return std::nullopt;
    case SettingType::kInteger:
      if (const auto value = wholeNumber<std::int64_t>(text); value && inRange(setting, static_cast<double>(*value))) {
        return SettingValue(*value);
      }
      return std::nullopt;
    case SettingType::kNumber:
      return parseNumber(setting, text);
    case SettingType::kAutoNumber:
      return text == "auto" ? SettingValue(std::string(text)) : parseNumber(setting, text);
    case SettingType::kChoice:
      return isChoice(setting, text) ? std::optional(SettingValue(std::string(text))) : std::nullopt;
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
              std::string(owner) + ": " + setting.key + " must be " + needed(setting) + ", got '" + seen + "'");
}

/// The text form of a JSON value of the setting's own type; none when the type is another.
std::optional<std::string> textOf(const Setting& setting, const nlohmann::json& value) {
  const bool takes_text = setting.type == SettingType::kChoice || setting.type == SettingType::kAutoNumber;
  if (value.is_string()) return takes_text ? std::optional(value.get<std::string>()) : std::nullopt;
  if (value.is_boolean()) {
    return setting.type == SettingType::kBool ? std::optional<std::string>(value.get<bool>() ? "true" : "false")
                                              : std::nullopt;
  }
  if (!value.is_number()) return std::nullopt;
  if (setting.type == SettingType::kInteger) {
    return value.is_number_integer() ? std::optional(value.dump()) : std::nullopt;
  }
  const bool takes_number = setting.type == SettingType::kNumber || setting.type == SettingType::kAutoNumber;
  return takes_number ? std::optional(formatNumber(value.get<double>())) : std::nullopt;
}

template <class Value>
const Value& typedSetting(const Settings& settings, const std::string& key) {
  const auto found = settings.find(key);
  FT_CHECK(found != settings.end());
  const Value* value = std::get_if<Value>(&found->second);
  FT_CHECK(value != nullptr);
  return *value;
}

nlohmann::json toJson(const SettingValue& value) {
  return std::visit([](const auto& held) { return nlohmann::json(held); }, value);
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
  }
  return "";
}

}  // namespace

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
    const std::optional<SettingValue> value = parseValue(*setting, text);
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
    row["min"] = isBounded(setting) ? nlohmann::json(setting.min) : nlohmann::json();
    row["max"] = isBounded(setting) ? nlohmann::json(setting.max) : nlohmann::json();
    if (setting.type == SettingType::kChoice) row["choices"] = setting.choices;
    json.push_back(std::move(row));
  }
  return json;
}

Result<Settings> settingsFromJson(std::string_view owner, std::span<const Setting> declared,
                                  const nlohmann::json& json) {
  if (!json.is_object()) return fail(ErrorCode::kBadInput, std::string(owner) + ": settings must be a JSON object");
  std::map<std::string, std::string> given;
  for (const Setting& setting : declared) {
    const auto found = json.find(setting.key);
    if (found == json.end()) {
      return fail(ErrorCode::kBadInput, std::string(owner) + ": setting " + setting.key + " is missing");
    }
    const std::optional<std::string> text = textOf(setting, *found);
    if (!text) return badValue(owner, setting, found->dump());
    given[setting.key] = *text;
  }
  for (const auto& [key, value] : json.items()) {
    if (findSetting(declared, key) == nullptr) return unknownKey(owner, declared, key);
  }
  return resolveSettings(owner, declared, given);
}

}  // namespace fieldtrue
