#pragma once

#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/core/run_control.h"
#include "calib/correctors/fit_data.h"
#include "calib/correctors/harmonic_field_physics.h"
#include "calib/correctors/harmonic_field_sites.h"

namespace fieldtrue {

struct HarmonicOptions {
  double least_gain = 4.0;  ///< Log evidence a further source must add [nats].
  std::size_t most_sources = 40;
};

/// Sources found, and the rigid motion that the disturbed alignment left undone.
struct HarmonicFit {
  DisturbedField field;
  Pose field_from_truth;                  ///< From the frame of FitData::p_true_m to the transmitter's.
  std::vector<Eigen::Vector3d> probes_m;  ///< Tracked positions where the uncertainty was asked for.
  std::vector<double> sd_m;               ///< Of the corrected position there: root of the trace of its covariance.
  double noise_factor = 1.0;              ///< Variance left over the variance stated; over 1 mm2 where none is.
};

/// Fits the sources to places by Gauss-Newton: each step takes the change of the corrected positions with the sources'
/// amplitudes as linear at the field found so far, chooses the sources anew, and offers the chosen ones closer places.
/// @param probes_m where the uncertainty is wanted, tracked positions, transmitter frame [m]
/// @error kDegenerate as fitRigid; kCancelled
Result<HarmonicFit> fitHarmonicField(const FitData& data, const HarmonicOptions& options,
                                     const std::vector<Eigen::Vector3d>& probes_m, const RunControl& control);

}  // namespace fieldtrue
