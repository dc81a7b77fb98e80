#include "calib/core/statistics.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/core/quantum.h"
#include "calib/core/units.h"

namespace fieldtrue {

namespace {

/// MAD to SD of a normal distribution: 1 / quantile(3/4).
/// No tracker resolves less: what takes the quantum's place where none is known.
constexpr double kFinestQuantum_m = 1e-6;
/// A lattice coarser than this in one node's samples is a coincidence of few values, not the tracker's.
constexpr double kCoarsestQuantum_m = 5e-3;
/// Likewise for the printed step; one node's few values are often whole millimetres by chance.
constexpr double kCoarsestPrinted_m = 5e-4;
constexpr double kFinestRotation_rad = 1e-6;
/// Readings printed with two decimals of a degree differ by this much without any outlier.
constexpr double kSmallestRotationSd_rad = 2e-4;
constexpr double kMissingMark = 1e20;

bool hasFinitePose(const Sample& sample) {
  const Pose& pose = sample.tracker_from_sensor;
  return pose.position_m.allFinite() && pose.orientation.coeffs().allFinite() && pose.orientation.norm() > 1e-6 &&
         !isMissingMark(pose.position_m.cwiseAbs().maxCoeff());
}

struct Screened {
  std::vector<std::size_t> good;  ///< Indices of the samples left, ascending.
  std::vector<Rejection> rejections;
};

Screened screenMarked(std::span<const Sample> samples) {
  Screened screened;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!samples[i].status.empty()) {
      screened.rejections.push_back({i, RejectionReason::kStatus, "status " + samples[i].status});
    } else if (!hasFinitePose(samples[i])) {
      screened.rejections.push_back(
          {i, RejectionReason::kNotFinite, "no usable reading (not finite or a missing mark)"});
    } else {
      screened.good.push_back(i);
    }
  }
  return screened;
}

Eigen::Vector3d medianPosition_m(std::span<const Sample> samples, const std::vector<std::size_t>& good) {
  Eigen::Vector3d middle_m;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const std::size_t i : good) values.push_back(samples[i].tracker_from_sensor.position_m[axis]);
    middle_m[axis] = median(std::move(values));
  }
  return middle_m;
}

/// Component-wise median of quaternions turned to one side of the mean: half of them may be wrong without moving it
/// far.
Eigen::Quaterniond medianRotation(std::span<const Sample> samples, const std::vector<std::size_t>& good) {
  std::vector<Eigen::Quaterniond> rotations;
  for (const std::size_t i : good) rotations.push_back(samples[i].tracker_from_sensor.orientation.normalized());
  const Eigen::Quaterniond side = meanRotation(rotations);
  Eigen::Vector4d middle;
  for (int part = 0; part < 4; ++part) {
    std::vector<double> values;
    for (const Eigen::Quaterniond& q : rotations) values.push_back(q.coeffs()[part] * (q.dot(side) < 0.0 ? -1.0 : 1.0));
    middle[part] = median(std::move(values));
  }
  const Eigen::Quaterniond q(middle);
  return q.norm() > 0.1 ? q.normalized() : side;
}

/// Largest deviation that still counts as noise.
double deviationLimit(const std::vector<double>& deviations, double smallest_sd, double threshold) {
  const double middle = median(deviations);
  std::vector<double> spread;
  for (const double deviation : deviations) spread.push_back(std::abs(deviation - middle));
  return middle + threshold * std::max(kSdPerMad * median(std::move(spread)), smallest_sd);
}

std::string phrase(double seen, double limit, const char* unit) {
  char text[96];
  std::snprintf(text, sizeof text, "%.3g %s from the median (limit %.3g %s)", seen, unit, limit, unit);
  return text;
}

void rejectOutliers(std::span<const Sample> samples, double quantum_m, double threshold, Screened& screened) {
  const Eigen::Vector3d middle_m = medianPosition_m(samples, screened.good);
  const Eigen::Quaterniond middle = medianRotation(samples, screened.good);
  std::vector<double> distances_m;
  std::vector<double> angles_rad;
  for (const std::size_t i : screened.good) {
    distances_m.push_back((samples[i].tracker_from_sensor.position_m - middle_m).norm());
    angles_rad.push_back(angleBetween_rad(samples[i].tracker_from_sensor.orientation, middle));
  }
  const double limit_m = deviationLimit(distances_m, std::max(quantum_m, kFinestQuantum_m), threshold);
  const double limit_rad = deviationLimit(angles_rad, kSmallestRotationSd_rad, threshold);
  std::vector<std::size_t> left;
  for (std::size_t k = 0; k < screened.good.size(); ++k) {
    const std::size_t i = screened.good[k];
    if (distances_m[k] > limit_m) {
      screened.rejections.push_back(
          {i, RejectionReason::kPositionOutlier, phrase(distances_m[k] * 1e3, limit_m * 1e3, "mm")});
    } else if (angles_rad[k] > limit_rad) {
      screened.rejections.push_back(
          {i, RejectionReason::kRotationOutlier, phrase(angles_rad[k] * kDegPerRad, limit_rad * kDegPerRad, "deg")});
    } else {
      left.push_back(i);
    }
  }
  screened.good = std::move(left);
  std::sort(screened.rejections.begin(), screened.rejections.end(),
            [](const Rejection& a, const Rejection& b) { return a.sample < b.sample; });
}

double quantumOf(std::span<const Sample> samples, const std::vector<std::size_t>& good) {
  std::vector<double> values_m;
  for (const std::size_t i : good) {
    for (int axis = 0; axis < 3; ++axis) values_m.push_back(samples[i].tracker_from_sensor.position_m[axis]);
  }
  const double quantum_m = findQuantum_m(values_m).value_or(0.0);
  if (quantum_m > 0.0 && quantum_m <= kCoarsestQuantum_m) return quantum_m;
  const double printed_m = printedStep_m(values_m);
  return printed_m >= kFinestQuantum_m && printed_m <= kCoarsestPrinted_m ? printed_m : 0.0;
}

void setPosition(std::span<const Sample> samples, const std::vector<std::size_t>& good, NodeStatistics& statistics) {
  // Differences to the first sample: the sums keep their digits however far from the origin the sensor is.
  const Eigen::Vector3d base_m = samples[good.front()].tracker_from_sensor.position_m;
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (const std::size_t i : good) sum_m += samples[i].tracker_from_sensor.position_m - base_m;
  statistics.mean.position_m = base_m + sum_m / static_cast<double>(good.size());
  for (const std::size_t i : good) {
    const Eigen::Vector3d d_m = samples[i].tracker_from_sensor.position_m - statistics.mean.position_m;
    statistics.covariance_m2 += d_m * d_m.transpose();
  }
  if (good.size() > 1) statistics.covariance_m2 /= static_cast<double>(good.size() - 1);
  const double step_m = statistics.quantum_m > 0.0 ? statistics.quantum_m : kFinestQuantum_m;
  for (int axis = 0; axis < 3; ++axis) {
    double& variance_m2 = statistics.covariance_m2(axis, axis);
    variance_m2 = std::max(variance_m2, step_m * step_m / 12.0);
  }
}

void setOrientation(std::span<const Sample> samples, const std::vector<std::size_t>& good, NodeStatistics& statistics) {
  std::vector<Eigen::Quaterniond> rotations;
  for (const std::size_t i : good) rotations.push_back(samples[i].tracker_from_sensor.orientation.normalized());
  statistics.mean.orientation = meanRotation(rotations);
  double sum_rad2 = 0.0;
  for (const Eigen::Quaterniond& q : rotations) {
    const double angle_rad = angleBetween_rad(q, statistics.mean.orientation);
    sum_rad2 += angle_rad * angle_rad;
  }
  statistics.sd_rot_rad = std::max(std::sqrt(sum_rad2 / static_cast<double>(rotations.size())), kFinestRotation_rad);
}

/// Lag-1 autocorrelation pooled over the axes; a pair counts when both samples followed each other and were accepted.
double autocorrelation(std::span<const Sample> samples, const std::vector<std::size_t>& good,
                       const Eigen::Vector3d& mean_m) {
  double pairs_m2 = 0.0;
  double squares_m2 = 0.0;
  for (std::size_t k = 0; k < good.size(); ++k) {
    const Eigen::Vector3d d_m = samples[good[k]].tracker_from_sensor.position_m - mean_m;
    squares_m2 += d_m.squaredNorm();
    if (k + 1 == good.size() || good[k + 1] != good[k] + 1) continue;
    pairs_m2 += d_m.dot(samples[good[k + 1]].tracker_from_sensor.position_m - mean_m);
  }
  const double rounding_m2 = 1e-30 * (1.0 + mean_m.squaredNorm()) * static_cast<double>(good.size());
  return squares_m2 > rounding_m2 ? pairs_m2 / squares_m2 : 1.0;
}

}  // namespace

Result<NodeStatistics> averageSamples(std::span<const Sample> samples, const AveragingOptions& options) {
  FT_CHECK(options.rejection_threshold > 0.0 && options.quantum_m >= 0.0);
  Screened screened = screenMarked(samples);
  if (screened.good.empty()) {
    const std::string seen = samples.empty()
                                 ? "no samples"
                                 : std::to_string(samples.size()) +
                                       " samples, all unusable (first: " + screened.rejections.front().text + ")";
    return fail(ErrorCode::kTooFewNodes, "Averaging needs at least one good sample, got " + seen);
  }
  NodeStatistics statistics;
  statistics.quantum_m = options.quantum_m > 0.0 ? options.quantum_m : quantumOf(samples, screened.good);
  if (options.reject_outliers) {
    rejectOutliers(samples, statistics.quantum_m, options.rejection_threshold, screened);
  }
  setPosition(samples, screened.good, statistics);
  setOrientation(samples, screened.good, statistics);
  const double n = static_cast<double>(screened.good.size());
  const double rho = autocorrelation(samples, screened.good, statistics.mean.position_m);
  statistics.autocorrelation = rho;
  statistics.n_effective = std::clamp(n * (1.0 - rho) / (1.0 + rho), 1.0, n);
  statistics.n_used = screened.good.size();
  statistics.rejections = std::move(screened.rejections);
  return statistics;
}

Eigen::Quaterniond meanRotation(std::span<const Eigen::Quaterniond> rotations, std::span<const double> weights) {
  FT_CHECK(!rotations.empty() && (weights.empty() || weights.size() == rotations.size()));
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const double weight = weights.empty() ? 1.0 : weights[i];
    FT_CHECK(weight >= 0.0);
    M += weight * rotations[i].coeffs() * rotations[i].coeffs().transpose();
  }
  // Of a symmetric positive matrix the first singular vector is the eigenvector of the largest eigenvalue.
  const Eigen::JacobiSVD<Eigen::Matrix4d> svd(M, Eigen::ComputeFullU);
  return canonical(Eigen::Quaterniond(Eigen::Vector4d(svd.matrixU().col(0))));
}

bool isMissingMark(double value) { return std::isfinite(value) && std::abs(value) > kMissingMark; }

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double quantile(std::vector<double> values, double fraction) {
  FT_CHECK(!values.empty() && fraction >= 0.0 && fraction <= 1.0);
  const double place = fraction * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(place);
  const auto middle = values.begin() + below;
  std::nth_element(values.begin(), middle, values.end());
  const double share = place - static_cast<double>(below);
  if (share == 0.0) return *middle;
  return *middle + share * (*std::min_element(middle + 1, values.end()) - *middle);
}

void setStatistics(Node& node, const NodeStatistics& statistics) {
  node.tracker_from_sensor = statistics.mean;
  node.covariance_m2 = statistics.covariance_m2;
  node.sd_rot_rad = node.has_orientation ? std::optional(statistics.sd_rot_rad) : std::nullopt;
  node.n_used = static_cast<int>(statistics.n_used);
  node.n_rejected = static_cast<int>(statistics.rejections.size());
  node.n_effective = statistics.n_effective;
}

}  // namespace fieldtrue
