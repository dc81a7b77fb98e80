#pragma once

#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::calibration {

/// The sensors whose readings fit a mirror image of their true places far better than any turn of them, in order: an
/// axis has the wrong sign, or two are exchanged. No field does that, and a correction that hides it must not be used.
std::vector<int> mirroredSensors(std::span<const Node> nodes);

/// What that means, without a full stop and beginning small; "" where there are none.
/// @param nodes all rows: where they are of one sensor, it is not named
std::string mirroredText(std::span<const Node> nodes);

}  // namespace fieldtrue::calibration
