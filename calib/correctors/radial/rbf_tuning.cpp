#include "calib/correctors/radial/rbf_tuning.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/correctors/numerics/dense_solver.h"
#include "calib/correctors/radial/rbf_system.h"

namespace fieldtrue::correctors {
namespace {

/// Below this share of the largest eigenvalue a smoothing is rounding.
constexpr double kSmallestOfLargest = 1e-12;
/// A smoothing must stand this far above the rounding of the matrix's own entries, which the tail takes off.
constexpr double kSmallestOfRounding = 1e3;
/// Above this multiple of it nothing but the tail is left.
constexpr double kLargestOfLargest = 1e3;
constexpr int kSmoothingSteps = 30;
/// Shapes tried first, in root mean squared distances of the places from their centre.
constexpr double kSmallestShape = 0.05;
constexpr double kLargestShape = 6.4;
constexpr int kShapeSteps = 7;
constexpr int kRefinements = 2;

/// The smoothing of least error at one shape.
RbfChoice bestSmoothing(const RbfLeaveOneOut& loo, double shape, std::optional<double> smoothing) {
  if (smoothing) return {shape, *smoothing, loo.rms_m(*smoothing)};
  const double low = std::log(loo.smallestSmoothing());
  double step = (std::log(loo.largestSmoothing()) - low) / kSmoothingSteps;
  RbfChoice best{shape, 0.0, HUGE_VAL};
  const auto consider = [&](double log_smoothing) {
    const double value = std::exp(log_smoothing);
    const double rms_m = loo.rms_m(value);
    // Ties go to the smoother: on exactly linear data every smoothing is as good as rounding.
    if (rms_m < best.loo_rms_m || (rms_m == best.loo_rms_m && value > best.smoothing)) best = {shape, value, rms_m};
  };
  for (int k = 0; k <= kSmoothingSteps; ++k) consider(low + step * k);
  for (int k = 0; k < 4; ++k) {
    step *= 0.5;
    const double center = std::log(best.smoothing);
    for (const double candidate : {center - step, center + step})
      if (candidate >= low) consider(candidate);
  }
  return best;
}

}  // namespace

bool hasShape(RadialKernel kernel) {
  return kernel == RadialKernel::kMultiquadric || kernel == RadialKernel::kInverseMultiquadric;
}

std::optional<RbfLeaveOneOut> RbfLeaveOneOut::of(const RbfProblem& problem, double shape) {
  // With D = diag(noise_weight)^-1/2 the system D Phi D + lambda I, D H, D Y has one smoothing for all places.
  const Eigen::VectorXd d = problem.noise_weight.cwiseSqrt().cwiseInverse();
  const auto projection = TailProjection::of(d.asDiagonal() * problem.frame.tail(problem.p_m));
  if (!projection) return std::nullopt;
  Eigen::MatrixXd scaled = kernelMatrix(problem.kernel, shape * shape, problem.frame, problem.p_m);
  for (Eigen::Index j = 0; j < scaled.cols(); ++j)
    scaled.col(j).tail(scaled.rows() - j).array() *= d.tail(scaled.rows() - j).array() * d[j];
  RbfLeaveOneOut loo;
  const double rounding = std::numeric_limits<double>::epsilon() * static_cast<double>(scaled.rows()) *
                          scaled.triangularView<Eigen::Lower>().toDenseMatrix().cwiseAbs().maxCoeff();
  Eigen::MatrixXd vectors = projection->projected(scaled);
  if (!symmetricEigenInPlace(vectors, loo.eigenvalues_)) return std::nullopt;
  loo.projected_y_ = vectors.transpose() * projection->toComplement(d.asDiagonal() * problem.y);
  loo.vectors_ = projection->fromComplement(vectors);
  loo.vectors_squared_ = loo.vectors_.cwiseAbs2();
  const double largest = loo.eigenvalues_.cwiseAbs().maxCoeff();
  loo.smallest_ = std::max({kSmallestOfLargest * largest, kSmallestOfRounding * rounding, 1e-300});
  loo.largest_ = std::max(kLargestOfLargest * largest, 2.0 * loo.smallest_);
  return loo;
}

double RbfLeaveOneOut::rms_m(double smoothing) const {
  const Eigen::VectorXd inverse =
      (eigenvalues_.array().max(0.0) + std::max(smoothing, smallest_)).cwiseInverse().matrix();
  const Eigen::VectorXd diagonal = vectors_squared_ * inverse;
  const Eigen::MatrixXd coefficients = vectors_ * (inverse.asDiagonal() * projected_y_);
  // A place with no weight left over holds up the tail alone; its error is not known, and it counts for nothing.
  double squares_m2 = 0.0;
  for (Eigen::Index i = 0; i < diagonal.size(); ++i)
    if (diagonal[i] > 0.0) squares_m2 += coefficients.row(i).squaredNorm() / (diagonal[i] * diagonal[i]);
  return std::sqrt(squares_m2 / static_cast<double>(diagonal.size()));
}

std::optional<RbfChoice> chooseRbf(const RbfProblem& problem, std::optional<double> shape,
                                   std::optional<double> smoothing, const RunControl& control) {
  if (!hasShape(problem.kernel)) shape = 1.0;
  std::optional<RbfChoice> best;
  const auto consider = [&](double candidate) {
    if (control.stop.stop_requested()) return false;
    const auto loo = RbfLeaveOneOut::of(problem, candidate);
    if (!loo) return false;
    const RbfChoice choice = bestSmoothing(*loo, candidate, smoothing);
    if (!best || choice.loo_rms_m < best->loo_rms_m) best = choice;
    return true;
  };
  if (shape) return consider(*shape) ? best : std::nullopt;
  double ratio = std::pow(kLargestShape / kSmallestShape, 1.0 / kShapeSteps);
  for (int k = 0; k <= kShapeSteps; ++k)
    if (!consider(kSmallestShape * std::pow(ratio, k))) return std::nullopt;
  for (int k = 0; k < kRefinements; ++k) {
    ratio = std::sqrt(ratio);
    const double center = best->shape;
    if (!consider(center / ratio) || !consider(center * ratio)) return std::nullopt;
  }
  return best;
}

}  // namespace fieldtrue::correctors
