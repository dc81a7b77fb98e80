#pragma once

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue::recording {

/// The places of one recording taken to be where an earlier recording reported them: what a diagnosis then finds is
/// what changed between the two. Places are joined by node number, an earlier place of several visits by its mean;
/// places that were not there before are left out. The alignment counts as unknown, and both seatings as placing.
/// @error kTooFewNodes where no node is in both
Result<CalibrationTable> changeSince(const CalibrationTable& before, const CalibrationTable& now);

}  // namespace fieldtrue::recording
