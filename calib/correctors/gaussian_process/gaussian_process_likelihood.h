#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/correctors/radial/rbf_field.h"
#include "calib/correctors/radial/rbf_system.h"

namespace fieldtrue::correctors {

/// Hyper-parameters of a Gaussian process with a Matern kernel: k(p, q) = signal_sd^2 matern(r), r^2 the squared
/// distance with each axis in units of its length.
struct GaussianProcessScales {
  Eigen::Vector3d length_m = Eigen::Vector3d::Ones();  ///< Along the frame's axes; in a plane the third is unused.
  double signal_sd_m = 1.0;                            ///< Per output.
  double nugget_sd_m = 0.0;  ///< Per output: what neither the field nor the stated noise explains.
};

/// A share of the signal's variance that keeps the matrix positive definite where places repeat.
inline constexpr double kGaussianProcessJitter = 1e-10;

/// Matrices alive at once: the covariance, its projection and what is factorised; later the inverse.
inline constexpr double kGaussianProcessMatrices = 3.0;

/// Outputs, which share one covariance.
inline constexpr double kOutputs = 3.0;

/// The frame with lengths as units.
FieldFrame scaledFrame(const FieldFrame& frame, const GaussianProcessScales& scales);

/// The covariance matrix of the places, lower triangle. @param noise_m2 stated, one number a place
Eigen::MatrixXd covarianceMatrix(RadialKernel kernel, const FieldFrame& frame, const GaussianProcessScales& scales,
                                 std::span<const Eigen::Vector3d> p_m, const Eigen::VectorXd& noise_m2);

/// Minus twice the restricted log-likelihood of values about a trend, up to a constant, for one covariance of all
/// outputs; and what its slope asks for.
struct RestrictedFit {
  double value = 0.0;
  Eigen::MatrixXd factor;  ///< Cholesky factor of Q2^T K Q2.
  Eigen::MatrixXd solved;  ///< (Q2^T K Q2)^-1 Q2^T Y
};

/// @param covariance lower triangle; @param projected_y Q2^T Y
/// @return none when the covariance is not positive definite to rounding
std::optional<RestrictedFit> restrictedFit(const TailProjection& projection, const Eigen::MatrixXd& covariance,
                                           const Eigen::MatrixXd& projected_y);

/// Minus twice the restricted log-likelihood of displacements about a linear trend, up to a constant, and its slope.
/// The three outputs share one covariance.
/// @source Patterson, Thompson 1971; Rasmussen, Williams 2006, eq. 2.45 and 5.9 with the trend taken out
class RestrictedLikelihood {
 public:
  static constexpr std::size_t kParameters = 5;
  /// Logarithms of three lengths, the signal's SD and the nugget's SD [log m].
  using Parameters = std::array<double, kParameters>;

  /// @param p_m, y, noise_m2 positions, displacements and stated noise of the places [m, m, m2]
  /// @return none when the places do not determine the trend
  static std::optional<RestrictedLikelihood> of(RadialKernel kernel, const FieldFrame& frame,
                                                std::vector<Eigen::Vector3d> p_m, Eigen::MatrixXd y,
                                                Eigen::VectorXd noise_m2);

  /// @param gradient out, one number a parameter, not computed when null; 0 for the unused length of a plane
  /// @return none when the covariance is not positive definite to rounding
  std::optional<double> evaluate(const Parameters& parameters, double* gradient) const;

  /// Mean square of an output about the linear trend [m2].
  double residualVariance_m2() const { return residual_variance_m2_; }
  std::size_t size() const { return p_m_.size(); }

 private:
  RestrictedLikelihood() = default;
  void addGradient(const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& weighted_y,
                   const GaussianProcessScales& scales, double* gradient) const;

  RadialKernel kernel_ = RadialKernel::kMatern52;
  FieldFrame frame_;
  std::vector<Eigen::Vector3d> p_m_;
  Eigen::MatrixXd y_;
  Eigen::VectorXd noise_m2_;
  std::optional<TailProjection> projection_;
  Eigen::MatrixXd projected_y_;
  double residual_variance_m2_ = 0.0;
};

GaussianProcessScales scalesOf(std::span<const double> parameters);

}  // namespace fieldtrue::correctors
