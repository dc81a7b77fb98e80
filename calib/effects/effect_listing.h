#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/effects/effect_row.h"

namespace fieldtrue::effects {

/// One way to fit an effect, as lists show it.
struct ListedWay {
  std::string name;
  std::vector<FitParameter> searched;
  std::vector<FitParameter> linear;
};

/// The ways an effect is fitted to a recording that shows it: 100 places 0.3 m apart about 1 m in front of the
/// transmitter, each visited in four orientations within an hour, the alignment known. Bounds that depend on the
/// recording are those of this one. Empty for an effect that only the readings themselves show.
std::vector<ListedWay> waysToFit(const Effect& effect);

/// As toJson of the registry, and for each effect `found_in` (`places` or `samples`) and `fits`: its ways with the
/// parameters they search and those that are linear.
nlohmann::json effectListing();

/// The same for people.
std::string effectListingText();

}  // namespace fieldtrue::effects
