#pragma once

#include <array>
#include <cstdint>

#include "calib/core/calibration_table.h"

namespace fieldtrue::testing {

/// A grid of places and how the tracker bends it. Everything is exact here; noise comes from SyntheticNoise.
struct SyntheticOptions {
  std::array<int, 3> counts{5, 5, 4};
  Eigen::Vector3d pitch_m{0.2, 0.2, 0.2};
  Eigen::Vector3d origin_m{0.3, -0.4, -0.3};  ///< True position of node (0, 0, 0).
  Pose reference_from_tracker;                ///< Alignment of rig and transmitter.
  int orientations = 1;  ///< Visits of each place, each at another true orientation; 1 = identity only.
  bool has_orientation = true;
  /// tracked = true + distortion: each axis a sine of one wave over the grid's diagonal, of this amplitude.
  double smooth_distortion_m = 0.0;
  /// tracked = (I + affine) true, exactly linear.
  Eigen::Matrix3d affine = Eigen::Matrix3d::Zero();
  /// Error rotation q_error = q_tracked q_true^-1 in the tracker frame: a smooth function of position of this
  /// amplitude.
  double orientation_error_rad = 0.0;
  double validation_fraction = 0.0;  ///< Share of places with role validation, drawn with the seed of the noise.
};

/// What is random, kept apart from the grid: the same grid can be made with and without.
struct SyntheticNoise {
  std::uint64_t seed = 1;
  double position_sd_m = 0.0;    ///< Per axis, of the node mean.
  double rotation_sd_rad = 0.0;  ///< Per axis, of the node mean.
  double placing_sd_m = 0.0;     ///< Per axis: the rig says the grid, the sensor stands elsewhere.
  double quantum_m = 0.0;        ///< Tracked positions are rounded to its multiples.
};

/// A calibration table with exactly known errors, in SI units and the frames of CalibrationTable.
CalibrationTable syntheticTable(const SyntheticOptions& options = {}, const SyntheticNoise& noise = {});

/// tracked minus true position at a true position, both in the tracker frame [m].
Eigen::Vector3d syntheticDisplacement_m(const SyntheticOptions& options, const Eigen::Vector3d& p_true_m);

/// The error rotation at a true position in the tracker frame.
Eigen::Quaterniond syntheticErrorRotation(const SyntheticOptions& options, const Eigen::Vector3d& p_true_m);

/// What a tracker with these errors reports for a true pose, both in the tracker frame.
Pose syntheticReading(const SyntheticOptions& options, const Pose& tracker_from_sensor_true);

}  // namespace fieldtrue::testing
