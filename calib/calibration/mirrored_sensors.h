#pragma once

#include <span>
#include <string>

#include "calib/core/calibration_table.h"

namespace fieldtrue::calibration {

/// Which sensors' readings fit a mirror image of their true places far better than any turn of them, and why: an axis
/// has the wrong sign, or two are exchanged. No field does that, and a correction that hides it must not be used.
/// @param nodes all rows: where they are of one sensor, it is not named
/// @return without a full stop and beginning small; "" where there are none
std::string mirroredText(std::span<const Node> nodes);

}  // namespace fieldtrue::calibration
