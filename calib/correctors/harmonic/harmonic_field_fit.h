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
  double placing_sd_m = 0.0;  ///< Per axis: as stated, else all that a rigid motion leaves.
  double noise_factor = 1.0;  ///< Variance of the noise as the fit leaves it, in units of this and the rows' own.
};

/// Fits the sources to places by Gauss-Newton: each step takes the change of the corrected positions with the sources'
/// amplitudes as linear at the field found so far, chooses the sources anew, and offers the chosen ones closer places.
/// Where single places lie far off what their neighbours make of the field, as a jig set down beside its mark does, the
/// fit is made again with less weight on them, and the likelier of both is kept.
/// @param data places that span a plane at least
/// @error kDegenerate as fitRigid; kCancelled
Result<HarmonicFit> fitHarmonicField(const FitData& data, const HarmonicOptions& options, const RunControl& control);

}  // namespace fieldtrue::correctors
