#pragma once

#include "calib/evaluation/held_out.h"
#include "calib/evaluation/held_out_job.h"

namespace fieldtrue::evaluation {

/// Adds what surrounds the scores: coverage, fold-back, dependence on orientation, the cost of resampling, and what
/// limits the recommended correction. The verdict must have been made.
/// @error kCancelled
Result<void> addSurroundings(Comparison& comparison, const CalibrationTable& table, const HeldOutJob& job,
                             const RunControl& control);

}  // namespace fieldtrue::evaluation
