#include "calib/correctors/splines/bspline_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

#include "calib/correctors/numerics/dense_solver.h"
#include "calib/correctors/radial/rbf_system.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kSmallestSmoothing = 1e-8;
constexpr double kLargestSmoothing = 1e8;
constexpr int kSteps = 8;
constexpr int kRefinements = 4;

}  // namespace

std::optional<SmoothingSpline> SmoothingSpline::of(SplineProblem problem) {
  const auto n = static_cast<Eigen::Index>(problem.p_m.size());
  FT_CHECK(problem.y.rows() == n && problem.x.rows() == n && problem.weight.size() == n);
  const Eigen::MatrixXd tail = problem.lattice.frame().tail(problem.p_m);
  const Eigen::VectorXd root = problem.weight.cwiseSqrt();
  if (!TailProjection::of(root.asDiagonal() * tail)) return std::nullopt;
  SmoothingSpline spline;
  Eigen::MatrixXd values(n, 6);
  values << problem.y, problem.x;
  const Eigen::MatrixXd weighted_tail = root.asDiagonal() * tail;
  spline.trend_ = weighted_tail.householderQr().solve(Eigen::MatrixXd(root.asDiagonal() * values));
  spline.detrended_ = values - tail * spline.trend_;
  const Eigen::Index m = problem.lattice.size();
  spline.gram_ = Eigen::MatrixXd::Zero(m, m);
  spline.right_ = Eigen::MatrixXd::Zero(m, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SplineWeights b =
        problem.lattice.weights(problem.lattice.frame().local(problem.p_m[static_cast<std::size_t>(i)]), {});
    const auto count = static_cast<std::size_t>(b.count);
    for (std::size_t k = 0; k < count; ++k) {
      const double weighted = problem.weight[i] * b.value[k];
      spline.right_.row(b.index[k]) += weighted * spline.detrended_.row(i);
      // The functions' indices ascend: these are the lower triangle's.
      for (std::size_t l = k; l < count; ++l) spline.gram_(b.index[l], b.index[k]) += weighted * b.value[l];
    }
    spline.basis_.push_back(b);
  }
  spline.penalty_ = problem.lattice.bendingPenalty();
  spline.penalty_ *= spline.gram_.trace() / spline.penalty_.trace();
  spline.problem_ = std::move(problem);
  return spline;
}

Eigen::MatrixXd SmoothingSpline::valuesAtPlaces(const Eigen::MatrixXd& coefficients) const {
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(problem_.y.rows(), coefficients.cols());
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const SplineWeights& b = basis_[static_cast<std::size_t>(i)];
    for (std::size_t k = 0; k < static_cast<std::size_t>(b.count); ++k)
      values.row(i) += b.value[k] * coefficients.row(b.index[k]);
  }
  return values;
}

std::optional<SmoothingSpline::Solved> SmoothingSpline::solved(double smoothing) const {
  Solved solved;
  solved.inverse = gram_ + smoothing * penalty_;
  if (!choleskyInPlace(solved.inverse)) return std::nullopt;
  solved.coefficients = right_;
  choleskySolve(solved.inverse, solved.coefficients);
  solved.residual = detrended_ - valuesAtPlaces(solved.coefficients);
  choleskyInverseInPlace(solved.inverse);
  // The trace of B N^-1 B^T W is that of N^-1 B^T W B: lower triangles count twice, the diagonal once.
  double trace = 0.0;
  for (Eigen::Index j = 0; j < gram_.cols(); ++j) {
    const Eigen::Index below = gram_.rows() - j;
    trace += 2.0 * solved.inverse.col(j).tail(below).dot(gram_.col(j).tail(below)) - solved.inverse(j, j) * gram_(j, j);
  }
  solved.degrees_of_freedom = trace;
  return solved;
}

std::optional<SmoothingSpline::Score> SmoothingSpline::score(double smoothing) const {
  const auto at = solved(smoothing);
  if (!at) return std::nullopt;
  const auto n = static_cast<double>(problem_.y.rows());
  const double left = n - at->degrees_of_freedom;
  if (!(left > 1e-6 * n)) return std::nullopt;
  const double squares_m2 = (problem_.weight.cwiseSqrt().asDiagonal() * at->residual.leftCols(3)).squaredNorm();
  return Score{n * squares_m2 / (left * left), at->degrees_of_freedom};
}

std::optional<double> SmoothingSpline::choose(const RunControl& control) const {
  std::optional<double> best;
  double best_gcv = HUGE_VAL;
  const auto consider = [&](double smoothing) {
    if (control.stop.stop_requested()) return;
    const auto at = score(smoothing);
    // Ties go to the smoother: on exactly linear data every smoothing is as good as rounding.
    if (!at || at->gcv > best_gcv) return;
    best_gcv = at->gcv;
    best = smoothing;
  };
  double ratio = std::pow(kLargestSmoothing / kSmallestSmoothing, 1.0 / kSteps);
  for (int k = 0; k <= kSteps; ++k) consider(kSmallestSmoothing * std::pow(ratio, k));
  for (int k = 0; k < kRefinements && best; ++k) {
    ratio = std::sqrt(ratio);
    const double center = *best;
    for (const double candidate : {center / ratio, center * ratio})
      if (candidate >= kSmallestSmoothing && candidate <= kLargestSmoothing) consider(candidate);
  }
  return control.stop.stop_requested() ? std::nullopt : best;
}

bool SmoothingSpline::solve(double smoothing) {
  auto at = solved(smoothing);
  if (!at || !at->coefficients.allFinite()) return false;
  inverse_ = std::move(at->inverse);
  completeSymmetric(inverse_);
  coefficients_ = std::move(at->coefficients);
  residual_ = std::move(at->residual);
  degrees_of_freedom_ = at->degrees_of_freedom;
  return true;
}

std::optional<SplineField> SmoothingSpline::without(std::span<const std::size_t> out,
                                                    const Pose& fold_from_data) const {
  const Eigen::Matrix3d rotation = fold_from_data.orientation.toRotationMatrix();
  const Eigen::Matrix3d turn = rotation - Eigen::Matrix3d::Identity();
  // R q + t - p = R (q - p) + (R - I) p + t, and the trend alone follows t.
  const auto moved = [&](const Eigen::MatrixXd& of_both) -> Eigen::MatrixXd {
    return of_both.leftCols(3) * rotation.transpose() + of_both.rightCols(3) * turn.transpose();
  };
  Eigen::MatrixXd coefficients = moved(coefficients_);
  Eigen::MatrixXd trend = moved(trend_);
  trend.row(0) += fold_from_data.position_m.transpose();
  if (out.empty()) return SplineField(problem_.lattice, coefficients, trend);
  // With S the places left out: (W_S^-1 - B_S N^-1 B_S^T) f = r_S, and the coefficients lose N^-1 B_S^T f.
  const auto n_out = static_cast<Eigen::Index>(out.size());
  if (n_out + trend.rows() > problem_.y.rows()) return std::nullopt;
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(inverse_.rows(), n_out);
  Eigen::MatrixXd residual(n_out, 6), block(n_out, n_out);
  for (Eigen::Index i = 0; i < n_out; ++i) {
    const SplineWeights& b = basis_[out[static_cast<std::size_t>(i)]];
    for (std::size_t k = 0; k < static_cast<std::size_t>(b.count); ++k)
      spread.col(i) += b.value[k] * inverse_.col(b.index[k]);
    residual.row(i) = residual_.row(static_cast<Eigen::Index>(out[static_cast<std::size_t>(i)]));
  }
  for (Eigen::Index i = 0; i < n_out; ++i) {
    const SplineWeights& b = basis_[out[static_cast<std::size_t>(i)]];
    block.row(i).setZero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(b.count); ++k)
      block.row(i) -= b.value[k] * spread.row(b.index[k]);
    block(i, i) += 1.0 / problem_.weight[static_cast<Eigen::Index>(out[static_cast<std::size_t>(i)])];
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(block);
  if (llt.info() != Eigen::Success) return std::nullopt;
  for (Eigen::Index i = 0; i < n_out; ++i) {
    const double whole = 1.0 / problem_.weight[static_cast<Eigen::Index>(out[static_cast<std::size_t>(i)])];
    // All but nothing of a place's weight is left: the fit hung on it.
    if (!(llt.matrixLLT()(i, i) * llt.matrixLLT()(i, i) > 1e-9 * whole)) return std::nullopt;
  }
  coefficients -= spread * llt.solve(moved(residual));
  return SplineField(problem_.lattice, coefficients, trend);
}

}  // namespace fieldtrue::correctors
