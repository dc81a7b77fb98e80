#pragma once

#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/core/run_control.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/harmonic/harmonic_field_linear.h"
#include "calib/correctors/harmonic/harmonic_field_physics.h"

namespace fieldtrue::correctors {

struct HarmonicOptions {
  double least_gain = 6.0;  ///< Log evidence a further source must add [nats].
  std::size_t most_sources = 40;
};

/// Sources found, and the rigid motion that the disturbed alignment left undone.
struct HarmonicFit {
  DisturbedField field;
  Pose field_from_truth;  ///< From the frame of FitData::p_true_m to the transmitter's.
  FieldPosterior posterior;
};

/// Fits the sources to places by Gauss-Newton: each step takes the change of the corrected positions with the sources'
/// amplitudes as linear at the field found so far, chooses the sources anew, and offers the chosen ones closer places.
/// @param data places that span a plane at least
/// @error kDegenerate as fitRigid; kCancelled
Result<HarmonicFit> fitHarmonicField(const FitData& data, const HarmonicOptions& options, const RunControl& control);

}  // namespace fieldtrue::correctors
