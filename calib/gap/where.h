#pragma once

#include "calib/gap/report.h"
#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// Where the gap lies: by row with the false-discovery rate controlled at 5 % (Benjamini and Hochberg 1995), hot-spot,
/// channels, bins of range, layer and time. Fills the report's parts of that name, floors and sizes.
/// @param with_effects the model with all selected effects; the same as none() where nothing was selected
void describeWhere(const identify::GapSearch& search, const identify::GapModel& with_effects, GapReport& report);

}  // namespace fieldtrue::gap
