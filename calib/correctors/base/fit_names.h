#pragma once

#include "calib/core/place_name.h"
#include "calib/correctors/base/fit_checks.h"

/// What people call the places of a fit, for its messages.
namespace fieldtrue::correctors {

inline std::string rowName(const FitData& data, std::size_t row) {
  return placeName(data.node[row], data.index.empty() ? std::nullopt : std::optional(data.index[row]));
}

inline PlaceNames namesOf(const Places& places) { return {places.node, places.index}; }

}  // namespace fieldtrue::correctors
