#include "calib/correctors/gaussian_process/gaussian_process_posterior.h"

#include <algorithm>

#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {

std::optional<GaussianProcessPosterior> GaussianProcessPosterior::of(const Eigen::MatrixXd& tail,
                                                                     const Eigen::MatrixXd& covariance) {
  auto projection = TailProjection::of(tail);
  if (!projection) return std::nullopt;
  GaussianProcessPosterior posterior(*std::move(projection));
  posterior.factor_ = posterior.projection_.projected(covariance);
  if (!choleskyInPlace(posterior.factor_)) return std::nullopt;
  const Eigen::MatrixXd q1 = posterior.projection_.tailBasis();
  posterior.k_of_weights_ = symmetricTimes(covariance, q1);
  posterior.weights_covariance_ = q1.transpose() * posterior.k_of_weights_;
  return posterior;
}

// Any weights w with H^T w = h predict without bias; those that start from w0 = Q1 R^-T h and add Q2 z have variance
// k0 - 2 w^T k + w^T K w, least where Q2^T K Q2 z = Q2^T (k - K w0).
double GaussianProcessPosterior::variance_m2(double prior_m2, const Eigen::VectorXd& k,
                                             const Eigen::VectorXd& h) const {
  const Eigen::VectorXd s = projection_.tailCoordinates(h);
  const double start_m2 = prior_m2 - 2.0 * s.dot(projection_.toTail(k).col(0)) + s.dot(weights_covariance_ * s);
  Eigen::VectorXd gap = projection_.toComplement(k - k_of_weights_ * s);
  choleskyForward(factor_, gap);
  return std::max(start_m2 - gap.squaredNorm(), 0.0);
}

Eigen::VectorXd GaussianProcessPosterior::weights(const Eigen::VectorXd& k, const Eigen::VectorXd& h) const {
  const Eigen::VectorXd s = projection_.tailCoordinates(h);
  Eigen::MatrixXd z = projection_.toComplement(k - k_of_weights_ * s);
  choleskySolve(factor_, z);
  return projection_.tailBasis() * s + projection_.fromComplement(z).col(0);
}

}  // namespace fieldtrue::correctors
