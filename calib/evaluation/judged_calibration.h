#pragma once

#include "calib/calibration/corrector.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// A calibration's position method, judged on the calibration's own rows at places its fits did not see.
/// @error as compareMethods
Result<Comparison> judgeCalibration(const calibration::Corrector& corrector, const RunControl& control);

/// The score of that method; null where it could not be judged.
const MethodScore* scoreOf(const Comparison& judged, const calibration::Corrector& corrector);

}  // namespace fieldtrue::evaluation
