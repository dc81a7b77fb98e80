#include "calib/correctors/method_label.h"

#include <algorithm>
#include <cctype>

#include "calib/core/file_io.h"
#include "calib/correctors/registry.h"

namespace fieldtrue::correctors {
namespace {

std::string valueText(const SettingValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "yes" : "no";
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  if (const auto* number = std::get_if<double>(&value)) return formatNumber(*number);
  return std::get<std::string>(value);
}

std::string lowered(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

template <class Method>
std::string labelOf(const Result<const Method*>& method, const std::string& id, const Settings& settings) {
  if (!method) return id;
  std::string changed;
  for (const Setting& setting : (*method)->settings) {
    const auto given = settings.find(setting.key);
    if (given == settings.end() || given->second == setting.default_value) continue;
    changed += (changed.empty() ? "" : ", ") + lowered(setting.label) + " " + valueText(given->second) +
               (setting.unit.empty() ? "" : " " + setting.unit);
  }
  return changed.empty() ? (*method)->label : (*method)->label + " (" + changed + ")";
}

}  // namespace

std::string positionLabel(const std::string& id, const Settings& settings) {
  return labelOf(findPositionMethod(id), id, settings);
}

std::string orientationLabel(const std::string& id, const Settings& settings) {
  return labelOf(findOrientationMethod(id), id, settings);
}

}  // namespace fieldtrue::correctors
