#pragma once

#include "calib/evaluation/calibration_difference.h"
#include "calib/evaluation/common_readings.h"

namespace fieldtrue::evaluation {

/// The change of corrected positions over the common readings, and the rigid motion that is taken out of it.
void measureField(const calibration::Corrector& first, const calibration::Corrector& second,
                  const CommonReadings& common, CalibrationDifference& to);

/// What is left between corrected orientations once the rotation that all share is taken out; nothing where neither
/// calibration corrects any.
void measureOrientation(const calibration::Corrector& first, const calibration::Corrector& second,
                        const CommonReadings& common, CalibrationDifference& to);

}  // namespace fieldtrue::evaluation
