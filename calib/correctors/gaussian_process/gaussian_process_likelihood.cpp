#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"

#include <cmath>

#include "calib/correctors/multiquadric/hmq_kernel.h"
#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
GaussianProcessScales scalesOf(std::span<const double> parameters) {
  return {{std::exp(parameters[0]), std::exp(parameters[1]), std::exp(parameters[2])},
          std::exp(parameters[3]),
          std::exp(parameters[4])};
}

FieldFrame scaledFrame(const FieldFrame& frame, const GaussianProcessScales& scales) {
  FieldFrame scaled = frame;
  scaled.per_m = scales.length_m.cwiseInverse();
  if (frame.dimension == 2) scaled.per_m.z() = 0.0;
  return scaled;
}

Eigen::MatrixXd covarianceMatrix(RadialKernel kernel, const FieldFrame& frame, const GaussianProcessScales& scales,
                                 std::span<const Eigen::Vector3d> p_m, const Eigen::VectorXd& noise_m2) {
  const double signal_m2 = scales.signal_sd_m * scales.signal_sd_m;
  Eigen::MatrixXd covariance = kernelMatrix(kernel, 0.0, scaledFrame(frame, scales), p_m);
  for (Eigen::Index j = 0; j < covariance.cols(); ++j) covariance.col(j).tail(covariance.rows() - j) *= signal_m2;
  covariance.diagonal().array() +=
      noise_m2.array() + (scales.nugget_sd_m * scales.nugget_sd_m + kGaussianProcessJitter * signal_m2);
  return covariance;
}

std::optional<RestrictedFit> restrictedFit(const TailProjection& projection, const Eigen::MatrixXd& covariance,
                                           const Eigen::MatrixXd& projected_y) {
  RestrictedFit fit{0.0, projection.projected(covariance), projected_y};
  if (!choleskyInPlace(fit.factor)) return std::nullopt;
  choleskySolve(fit.factor, fit.solved);
  // log |Q2^T K Q2| is log |K| + log |H^T K^-1 H| - log |H^T H|.
  const auto n_outputs = static_cast<double>(projected_y.cols());
  fit.value = n_outputs * choleskyLogDeterminant(fit.factor) + projected_y.cwiseProduct(fit.solved).sum();
  return std::isfinite(fit.value) ? std::optional(std::move(fit)) : std::nullopt;
}

std::optional<RestrictedLikelihood> RestrictedLikelihood::of(RadialKernel kernel, const FieldFrame& frame,
                                                             std::vector<Eigen::Vector3d> p_m, Eigen::MatrixXd y,
                                                             Eigen::VectorXd noise_m2) {
  FT_CHECK(y.rows() == static_cast<Eigen::Index>(p_m.size()) && y.cols() == 3 && noise_m2.size() == y.rows());
  RestrictedLikelihood likelihood;
  likelihood.projection_ = TailProjection::of(frame.tail(p_m));
  if (!likelihood.projection_) return std::nullopt;
  likelihood.kernel_ = kernel;
  likelihood.frame_ = frame;
  likelihood.p_m_ = std::move(p_m);
  likelihood.noise_m2_ = std::move(noise_m2);
  likelihood.projected_y_ = likelihood.projection_->toComplement(y);
  likelihood.y_ = std::move(y);
  likelihood.residual_variance_m2_ =
      likelihood.projected_y_.squaredNorm() / static_cast<double>(likelihood.projected_y_.size());
  return likelihood;
}

std::optional<double> RestrictedLikelihood::evaluate(const Parameters& parameters, double* gradient) const {
  const GaussianProcessScales scales = scalesOf(parameters);
  auto fit = restrictedFit(*projection_, covarianceMatrix(kernel_, frame_, scales, p_m_, noise_m2_), projected_y_);
  if (!fit) return std::nullopt;
  if (gradient != nullptr) {
    choleskyInverseInPlace(fit->factor);
    addGradient(projection_->lifted(fit->factor), projection_->fromComplement(fit->solved), scales, gradient);
  }
  return fit->value;
}

// d(-2 log L)/d theta = sum_ij D_ij dK_ij / d theta with D = 3 P - (P Y)(P Y)^T.
void RestrictedLikelihood::addGradient(const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& weighted_y,
                                       const GaussianProcessScales& scales, double* gradient) const {
  const FieldFrame scaled = scaledFrame(frame_, scales);
  std::array<std::vector<double>, 3> u;
  for (const Eigen::Vector3d& place_m : p_m_)
    for (std::size_t axis = 0; axis < 3; ++axis) u[axis].push_back(scaled.local(place_m)[static_cast<int>(axis)]);
  const std::size_t n = p_m_.size();
  Eigen::VectorXd q(static_cast<Eigen::Index>(n)), weighted(q.size()), squares(q.size());
  double of_signal = 0.0, of_diagonal = 0.0;
  std::array<double, 3> of_lengths{};
  for (std::size_t j = 0; j < n; ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    const auto below = static_cast<Eigen::Index>(n - j - 1);
    const double diagonal = kOutputs * inverse(column, column) - weighted_y.row(column).squaredNorm();
    of_diagonal += diagonal;
    const Eigen::VectorXd d =
        kOutputs * inverse.col(column).tail(below) - weighted_y.bottomRows(below) * weighted_y.row(column).transpose();
    const std::array<double, 3> center = {u[0][j], u[1][j], u[2][j]};
    const auto count = static_cast<std::size_t>(below);
    squaredDistances({u[0].data() + j + 1, u[1].data() + j + 1, u[2].data() + j + 1, count}, center.data(), q.data());
    radialValues(kernel_, 0.0, q.data(), count, weighted.data());
    of_signal += 2.0 * dotProduct(weighted.data(), d.data(), count) + (1.0 + kGaussianProcessJitter) * diagonal;
    radialSlopes(kernel_, 0.0, q.data(), count, weighted.data());
    weighted.head(below).array() *= d.array();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Eigen::Map<const Eigen::ArrayXd> others(u[axis].data() + j + 1, below);
      squares.head(below) = (others - center[axis]).square();
      of_lengths[axis] += 2.0 * dotProduct(weighted.data(), squares.data(), count);
    }
  }
  const double signal_m2 = scales.signal_sd_m * scales.signal_sd_m;
  for (std::size_t axis = 0; axis < 3; ++axis) gradient[axis] = -signal_m2 * of_lengths[axis];
  gradient[3] = 2.0 * signal_m2 * of_signal;
  gradient[4] = 2.0 * scales.nugget_sd_m * scales.nugget_sd_m * of_diagonal;
}

}  // namespace fieldtrue::correctors
