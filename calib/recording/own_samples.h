#pragma once

#include <optional>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/recording/finding.h"

namespace fieldtrue::recording {

/// Holds the mean of each stop's readings against the tracked position of its row: off it by more than 1 mm and by more
/// than 10 standard errors, they are of another recording. Readings of sensors that the table does not hold are passed
/// over, unless all are.
/// @return the places whose readings are not theirs; none where all are
/// @error kBadInput where no reading has a row, or more than half of the places that have one are off
Result<std::optional<GapFinding>> foreignSamples(const SampleTable& samples, const CalibrationTable& table);

}  // namespace fieldtrue::recording
