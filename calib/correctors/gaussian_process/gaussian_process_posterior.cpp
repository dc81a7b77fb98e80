#include "calib/correctors/gaussian_process/gaussian_process_posterior.h"

#include <algorithm>

#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {

std::optional<GaussianProcessPosterior> GaussianProcessPosterior::of(const RadialField& field,
                                                                     const GaussianProcessScales& scales,
                                                                     const Eigen::VectorXd& noise_m2) {
  auto projection = TailProjection::of(field.frame().tail(field.centers_m()));
  if (!projection) return std::nullopt;
  GaussianProcessPosterior posterior(*std::move(projection));
  posterior.signal_m2_ = scales.signal_sd_m * scales.signal_sd_m;
  const Eigen::MatrixXd covariance =
      covarianceMatrix(field.kernel(), field.frame(), scales, field.centers_m(), noise_m2);
  posterior.factor_ = posterior.projection_.projected(covariance);
  if (!choleskyInPlace(posterior.factor_)) return std::nullopt;
  const Eigen::MatrixXd q1 = posterior.projection_.tailBasis();
  posterior.k_of_weights_ = symmetricTimes(covariance, q1);
  posterior.weights_covariance_ = q1.transpose() * posterior.k_of_weights_;
  return posterior;
}

// Any weights w with H^T w = h predict without bias; those that start from w0 = Q1 R^-T h and add Q2 z have variance
// k0 - 2 w^T k + w^T K w, least where Q2^T K Q2 z = Q2^T (k - K w0).
double GaussianProcessPosterior::variance_m2(const RadialField& field, const Eigen::Vector3d& p_m) const {
  const Eigen::VectorXd k = signal_m2_ * field.kernelValues(p_m);
  const Eigen::VectorXd h = field.frame().tail(std::span(&p_m, 1)).row(0).transpose();
  const Eigen::VectorXd s = projection_.tailCoordinates(h);
  const double start_m2 = signal_m2_ - 2.0 * s.dot(projection_.toTail(k).col(0)) + s.dot(weights_covariance_ * s);
  Eigen::VectorXd gap = projection_.toComplement(k - k_of_weights_ * s);
  choleskyForward(factor_, gap);
  return std::max(start_m2 - gap.squaredNorm(), 0.0);
}

}  // namespace fieldtrue::correctors
