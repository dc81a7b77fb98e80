#pragma once

#include <Eigen/Core>

#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// How well a Gaussian process with a linear trend knows its field: the variance of universal kriging.
/// @source Matheron 1969; Rasmussen, Williams 2006, eq. 2.42
class GaussianProcessPosterior {
 public:
  /// Factorises the covariance of the places. @param field holds kernel, frame and places
  static std::optional<GaussianProcessPosterior> of(const RadialField& field, const GaussianProcessScales& scales,
                                                    const Eigen::VectorXd& noise_m2);

  /// Variance of the smooth field per output at a position [m2]; the nugget is not in it.
  double variance_m2(const RadialField& field, const Eigen::Vector3d& p_m) const;

 private:
  explicit GaussianProcessPosterior(TailProjection projection) : projection_(std::move(projection)) {}

  double signal_m2_ = 0.0;
  TailProjection projection_;
  Eigen::MatrixXd factor_;              ///< Cholesky factor of Q2^T K Q2.
  Eigen::MatrixXd k_of_weights_;        ///< K Q1
  Eigen::MatrixXd weights_covariance_;  ///< Q1^T K Q1
};

}  // namespace fieldtrue::correctors
