#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"
#include "calib/correctors/gaussian_process/gaussian_process_search.h"
#include "calib/correctors/radial/rbf_field.h"
#include "calib/correctors/radial/rbf_system.h"
#include "calib/correctors/radial/turn_correlation.h"

namespace fieldtrue::correctors {

/// Hyper-parameters of a Gaussian process over poses: k((p, R), (p', R')) = signal_sd^2 matern(r) + turn_sd^2
/// matern(r / turn_stretch) matern(c / turn_length_rad), r the distance with each axis in units of its length and
/// c = 2 sin(angle/2) the chord of the rotation between the two, near the angle for small ones. The chord is a distance
/// between rotation matrices as points of R^9, so that the kernel is positive definite on rotations, and q = -q.
struct PoseScales {
  GaussianProcessScales field;  ///< Its nugget is shared by the rows of a place: of placing, where that is not stated.
  double row_sd_m = 0.0;        ///< Per output: what is unexplained of each row for itself.
  double turn_sd_m = 0.0;       ///< Per output: of the part that changes as the sensor turns.
  double turn_stretch = 1.0;
  double turn_length_rad = 1.0;
};

/// What is measured: rows, several of which may be at one place.
struct PoseRows {
  std::vector<Eigen::Vector3d> p_m;   ///< Tracked.
  std::vector<Eigen::Quaterniond> q;  ///< Tracked; tracker_from_sensor.
  std::vector<std::size_t> place;     ///< Of each row.
  std::vector<double> noise_m2;       ///< Of each row's own reading, per axis.
  double placing_m2 = 0.0;            ///< Variance of placing, per axis, which rows of one place share.

  std::size_t size() const { return p_m.size(); }
  PoseRows without(std::span<const std::size_t> out) const;
  PoseRows only(std::span<const std::size_t> kept) const;
};

/// The frame of the part that changes as the sensor turns.
FieldFrame turnFrame(const FieldFrame& frame, const PoseScales& scales);

/// The covariance matrix of the rows, lower triangle.
Eigen::MatrixXd poseCovariance(RadialKernel kernel, const FieldFrame& frame, const PoseScales& scales,
                               const PoseRows& rows);

/// RestrictedLikelihood over poses; without the part that turns it is that of position alone, for the same rows.
class PoseLikelihood {
 public:
  /// Logarithms: three lengths, signal, nugget, the rows' own SD.
  static constexpr std::size_t kPositionParameters = kFieldParameters + 1;
  /// And with the part that turns its SD, its stretch and its length [rad].
  static constexpr std::size_t kParameters = kPositionParameters + 3;

  /// @param y displacements of the rows [m] @return none when the rows do not determine the trend
  static std::optional<PoseLikelihood> of(RadialKernel kernel, const FieldFrame& frame, PoseRows rows,
                                          const Eigen::MatrixXd& y);

  /// @param parameters kParameters of them, or kPositionParameters for position alone; @param gradient as many, or null
  /// @return none when the covariance is not positive definite to rounding
  std::optional<double> evaluate(std::span<const double> parameters, double* gradient) const;

  double residualVariance_m2() const { return residual_variance_m2_; }
  std::size_t size() const { return rows_.size(); }

 private:
  PoseLikelihood() = default;
  void addGradient(const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& weighted_y, const PoseScales& scales,
                   double* gradient) const;

  RadialKernel kernel_ = RadialKernel::kMatern52;
  FieldFrame frame_;
  PoseRows rows_;
  std::optional<TailProjection> projection_;
  Eigen::MatrixXd projected_y_;
  double residual_variance_m2_ = 0.0;
};

PoseScales poseScalesOf(std::span<const double> parameters);

}  // namespace fieldtrue::correctors
