#pragma once

#include <array>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/units.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {

/// Rows turned less far apart than this are in the same orientation: a jig is not set down straighter.
inline constexpr double kSameOrientation_rad = 5.0 * kRadPerDeg;

/// What a correction method is fitted to: matching true and tracked poses, all in the tracker frame [m].
/// The truth has already been brought there by the alignment (or is there by declaration).
struct FitData {
  std::vector<Eigen::Vector3d> p_tracked_m;
  std::vector<Eigen::Vector3d> p_true_m;
  std::vector<Eigen::Quaterniond> q_tracked;  ///< Empty when the table has no orientation.
  std::vector<Eigen::Quaterniond> q_true;     ///< Same length as q_tracked.
  std::vector<int> node;                      ///< Place of each row, for messages and for grouping visits.
  std::vector<std::array<int, 3>> index;      ///< Grid index of each row; empty when the places are scattered.
  /// Covariance of each row's mean tracked position, tracker frame; empty when the table states none.
  std::vector<Eigen::Matrix3d> noise_m2;
  double jig_sd_m = 0.0;  ///< SD of placing, per axis: noise of p_true_m; 0 = not stated.
  bool is_dipole = true;  ///< What is known of dipole trackers may be used: the table names no other transmitter.
  int dimension = 3;      ///< Spread of the true positions: 3 volume, 2 one plane, 1 line, 0 point.

  std::size_t size() const { return p_tracked_m.size(); }
  bool hasOrientation() const { return !q_tracked.empty(); }
};

}  // namespace fieldtrue::correctors
