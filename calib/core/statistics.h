#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue {

/// How a node's samples are averaged.
struct AveragingOptions {
  bool reject_outliers = true;
  /// A sample is rejected when its 3-D distance from the median position exceeds the median of these distances by more
  /// than this many robust SDs (1.4826 MAD) of the distances; rotation angles likewise.
  double rejection_threshold = 4.0;
  double quantum_m = 0.0;  ///< Position lattice of the tracker; 0 = found from the samples.
};

enum class RejectionReason { kStatus, kNotFinite, kPositionOutlier, kRotationOutlier };

struct Rejection {
  std::size_t sample = 0;  ///< Index into the span given.
  RejectionReason reason = RejectionReason::kStatus;
  std::string text;  ///< One phrase for the operator: "12.3 mm from the median (limit 2.1 mm)".
};

/// Mean pose of a still sensor and how well it is known.
struct NodeStatistics {
  Pose mean;
  /// Of a single accepted sample (n - 1), variances floored by quantum^2/12, with 1 um where no quantum is known.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  double sd_rot_rad = 0.0;       ///< RMS rotation angle of a single accepted sample about the mean, at least 1e-6.
  double autocorrelation = 0.0;  ///< Lag 1, pooled over the axes, in sample order; 1 when all samples are the same.
  double n_effective = 1.0;      ///< n (1 - rho) / (1 + rho), in [1, n].
  double quantum_m = 0.0;        ///< Lattice or printed step used for the floor; 0 = none found.
  std::size_t n_used = 0;
  std::vector<Rejection> rejections;  ///< In sample order.
};

/// Averages the samples of one sensor at one place.
/// @error kTooFewNodes when no good sample is left
Result<NodeStatistics> averageSamples(std::span<const Sample> samples, const AveragingOptions& options = {});

/// Average rotation: the eigenvector of the largest eigenvalue of sum w q q^T; q and -q count as the same rotation.
/// @param weights empty = equal; otherwise as many as rotations, not negative
/// @source Markley, Cheng, Crassidis, Oshman 2007, Averaging Quaternions, eq. 12-13
Eigen::Quaterniond meanRotation(std::span<const Eigen::Quaterniond> rotations, std::span<const double> weights = {});

/// Whether a number is one of the marks that trackers' recordings put for a missing reading, such as -3.7e28.
bool isMissingMark(double value);

double median(std::vector<double> values);
/// Linear-interpolated quantile, fraction in [0, 1] (Hyndman and Fan 1996, type 7).
double quantile(std::vector<double> values, double fraction);

/// Copies the statistics into a node row (pose, covariance, counts), leaving identity, truth, times and role alone.
void setStatistics(Node& node, const NodeStatistics& statistics);

}  // namespace fieldtrue
