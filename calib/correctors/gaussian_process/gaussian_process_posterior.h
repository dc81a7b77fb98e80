#pragma once

#include <Eigen/Core>

#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// How well a Gaussian process with a linear trend knows its field: the variance of universal kriging.
/// @source Matheron 1969; Rasmussen, Williams 2006, eq. 2.42
class GaussianProcessPosterior {
 public:
  /// Factorises. @param tail FieldFrame::tail of what was measured; @param covariance of it, lower triangle [m2]
  static std::optional<GaussianProcessPosterior> of(const Eigen::MatrixXd& tail, const Eigen::MatrixXd& covariance);

  /// Variance of the field per output at one input [m2]; the nugget is not in it.
  /// @param prior_m2 before anything was measured; @param k covariance with each measurement [m2]; @param h its tail
  double variance_m2(double prior_m2, const Eigen::VectorXd& k, const Eigen::VectorXd& h) const;
  /// How much of each measurement the field there is made of.
  Eigen::VectorXd weights(const Eigen::VectorXd& k, const Eigen::VectorXd& h) const;

 private:
  explicit GaussianProcessPosterior(TailProjection projection) : projection_(std::move(projection)) {}

  TailProjection projection_;
  Eigen::MatrixXd factor_;              ///< Cholesky factor of Q2^T K Q2.
  Eigen::MatrixXd k_of_weights_;        ///< K Q1
  Eigen::MatrixXd weights_covariance_;  ///< Q1^T K Q1
};

}  // namespace fieldtrue::correctors
