#pragma once

#include <optional>
#include <string>

#include "calib/calibration/corrector.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// A calibration's position method, judged on the calibration's own rows at places its fits did not see.
/// @error as compareMethods
Result<Comparison> judgeCalibration(const calibration::Corrector& corrector, const RunControl& control);

/// The score of that method; null where it could not be judged.
const MethodScore* scoreOf(const Comparison& judged, const calibration::Corrector& corrector);

/// How far a position method errs on places that its fits did not see, and on which.
struct HeldOutRms {
  double rms_mm = 0.0;
  std::string validated;  ///< "loo", "kfold:10"
};

/// None where it could not be judged, or where that would take minutes.
std::optional<HeldOutRms> heldOutRms(const calibration::Corrector& corrector, const RunControl& control);

}  // namespace fieldtrue::evaluation
