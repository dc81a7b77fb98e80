#include "widgets/compare/method_list.h"

#include "calib/correctors/base/method_text.h"
#include "calib/correctors/method_label.h"
#include "calib/correctors/registry.h"

namespace fieldtrue::widgets {
namespace {

template <class Method>
std::vector<MethodEntry> entriesOf(std::span<const Method> methods) {
  std::vector<MethodEntry> entries;
  for (const Method& method : methods)
    if (method.id != "none")
      entries.push_back(
          {method.id, defaultSettings(method.settings), method.cost != correctors::FitCost::kVeryCostly, false});
  return entries;
}

template <class Method>
MethodInfo infoOf(const Result<const Method*>& method, const std::string& id) {
  if (!method) return {QString::fromStdString(id), {}, {}, false};
  return {QString::fromStdString((*method)->label), (*method)->settings, QString::fromStdString((*method)->source),
          (*method)->isCostly()};
}

}  // namespace

std::vector<MethodEntry> registeredMethods(MethodPart part) {
  return part == MethodPart::kPosition ? entriesOf(correctors::positionMethods())
                                       : entriesOf(correctors::orientationMethods());
}

MethodInfo methodInfo(MethodPart part, const std::string& id) {
  return part == MethodPart::kPosition ? infoOf(correctors::findPositionMethod(id), id)
                                       : infoOf(correctors::findOrientationMethod(id), id);
}

QString methodLabel(MethodPart part, const std::string& id, const Settings& settings) {
  return QString::fromStdString(part == MethodPart::kPosition ? correctors::positionLabel(id, settings)
                                                              : correctors::orientationLabel(id, settings));
}

Settings defaultSettings(std::span<const Setting> declared) {
  Settings settings;
  for (const Setting& setting : declared) settings[setting.key] = setting.default_value;
  return settings;
}

std::vector<MethodText> quickMethods(MethodPart part, std::vector<MethodEntry> entries) {
  for (MethodEntry& entry : entries) entry.ticked = entry.ticked && !methodInfo(part, entry.id).slow;
  return tickedMethods(entries);
}

std::vector<MethodText> tickedMethods(std::span<const MethodEntry> entries) {
  std::vector<MethodText> methods;
  for (const MethodEntry& entry : entries)
    if (entry.ticked) methods.push_back(methodTextOf(entry.id, entry.settings));
  return methods;
}

MethodText methodTextOf(const std::string& id, const Settings& settings) {
  return parseMethodText(correctors::methodText(id, settings)).value_or(MethodText{id, {}});
}

}  // namespace fieldtrue::widgets
