#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calib/core/run_control.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// What a radial fit's shape and smoothing are chosen for.
struct RbfProblem {
  RadialKernel kernel = RadialKernel::kMultiquadric;
  FieldFrame frame;
  std::span<const Eigen::Vector3d> p_m;
  Eigen::MatrixXd y;             ///< Displacements, one row a place [m].
  Eigen::VectorXd noise_weight;  ///< Noise variance of each place over the mean one.
};

/// Shape c and smoothing lambda of A = Phi(c) + lambda diag(noise_weight), in the frame's units.
struct RbfChoice {
  double shape = 1.0;
  double smoothing = 0.0;
  double loo_rms_m = 0.0;  ///< Leave-one-out error, 3-D, each place's square divided by its noise weight.
};

/// Whether a kernel has a shape c at all.
bool hasShape(RadialKernel kernel);

/// Leave-one-out error of one shape at any number of smoothings, from one eigenvalue decomposition.
class RbfLeaveOneOut {
 public:
  /// @return none when the places do not determine the linear tail
  static std::optional<RbfLeaveOneOut> of(const RbfProblem& problem, double shape);
  /// Smallest smoothing that rounding allows.
  double smallestSmoothing() const { return smallest_; }
  double largestSmoothing() const { return largest_; }
  /// As RbfChoice::loo_rms_m. @param smoothing between the two; smaller is taken as the smallest
  double rms_m(double smoothing) const;

 private:
  Eigen::MatrixXd vectors_;          ///< Q2 V
  Eigen::MatrixXd vectors_squared_;  ///< Entry by entry.
  Eigen::VectorXd eigenvalues_;
  Eigen::MatrixXd projected_y_;  ///< V^T Q2^T Y
  double smallest_ = 0.0;
  double largest_ = 0.0;
};

/// The shape and smoothing of least leave-one-out error: a grid in log space, then finer steps around its best.
/// @param shape, smoothing fixed values where given
/// @return none when the places do not determine the linear tail or `control` asked to stop
/// @source Rippa 1999; the eigenvalue form of ridge regression, Golub, Heath, Wahba 1979
std::optional<RbfChoice> chooseRbf(const RbfProblem& problem, std::optional<double> shape,
                                   std::optional<double> smoothing, const RunControl& control);

}  // namespace fieldtrue::correctors
