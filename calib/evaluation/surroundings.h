#pragma once

#include "calib/evaluation/held_out.h"

namespace fieldtrue {

/// Adds what surrounds the scores: coverage, fold-back, dependence on orientation, the cost of resampling, and what
/// limits the recommended correction. The verdict must have been made.
/// @error kCancelled
Result<void> addSurroundings(Comparison& comparison, const CalibrationTable& table, const HeldOutJob& job,
                             const RunControl& control);

}  // namespace fieldtrue
