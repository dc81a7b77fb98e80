#pragma once

#include <QString>
#include <span>
#include <vector>

#include "calib/evaluation/comparison.h"

namespace fieldtrue::widgets {

enum class MethodPart { kPosition, kOrientation };

/// A method with settings that a person may compare.
struct MethodEntry {
  std::string id;
  Settings settings;
  bool ticked = true;
  bool variant = false;  ///< Added by a person beside the method with its defaults.
  bool operator==(const MethodEntry&) const = default;
};

/// What menus and forms need of a registry row.
struct MethodInfo {
  QString label;
  std::span<const Setting> settings;
  QString source;
  bool slow = false;  ///< A comparison refits it less often than asked.
};

/// Every method of the registry with its defaults, all but the slowest ones ticked; "none" is left out, for it is the
/// error before.
std::vector<MethodEntry> registeredMethods(MethodPart part);
MethodInfo methodInfo(MethodPart part, const std::string& id);
/// "Polynomial (degree 4)"
QString methodLabel(MethodPart part, const std::string& id, const Settings& settings);

Settings defaultSettings(std::span<const Setting> declared);

/// The ticked ones as a comparison wants them.
std::vector<MethodText> tickedMethods(std::span<const MethodEntry> entries);
/// Those of the ticked ones that are not slow.
std::vector<MethodText> quickMethods(MethodPart part, std::vector<MethodEntry> entries);
MethodText methodTextOf(const std::string& id, const Settings& settings);

}  // namespace fieldtrue::widgets
