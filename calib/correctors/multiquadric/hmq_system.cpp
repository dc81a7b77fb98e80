#include "calib/correctors/multiquadric/hmq_system.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "calib/core/place_name.h"
#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kMaxCenters = 10000;  // 800 MB for the matrix.
/// Largest residual that is left as it is [m]; a larger one improves the solution once.
constexpr double kResidualLimit_m = 1e-10;
/// c over the largest entry that M may have: 1/(1^T M^-1 1), which c must exceed, was at most 1.3 of that entry for
/// grids of 125 to 1728 places and R^2 from 10 to 1000 cm2 wherever M could be solved at all.
constexpr double kShiftOfLargest = 4.0;

Result<void> checkCenters(const std::string& name, const Places& places, const RunControl& control) {
  FT_CHECK(places.size() > 0);
  if (places.size() > kMaxCenters)
    return fail(ErrorCode::kUnsupported, name + " takes at most " + std::to_string(kMaxCenters) + " places, got " +
                                             std::to_string(places.size()) + "; use a polynomial");
  std::map<std::array<double, 3>, std::size_t> seen;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d& p_m = places.p_tracked_m[i];
    const auto [other, is_new] = seen.try_emplace({p_m.x(), p_m.y(), p_m.z()}, i);
    if (is_new) continue;
    const PlaceNames names(places.node, places.index);
    return fail(ErrorCode::kDegenerate, name + ": " + names.of(places.node[other->second]) + " and " +
                                            names.of(places.node[i]) +
                                            " were tracked at exactly the same position, and one curve cannot pass "
                                            "through both; measure one of them again or skip it");
  }
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  return {};
}

tl::unexpected<Error> spoiltByRounding(const std::string& name, double r2_m2) {
  return fail(ErrorCode::kDegenerate, name + ": the places stand so close together, compared with R = " +
                                          std::to_string(std::lround(std::sqrt(r2_m2) * 1000.0)) +
                                          " mm, that rounding spoils the solution; use a smaller R squared");
}

}  // namespace

MultiquadricArrays arraysOf(const Eigen::MatrixX3d& centers_m, double r2_m2, Eigen::Index first) {
  return {centers_m.col(0).data() + first, centers_m.col(1).data() + first, centers_m.col(2).data() + first,
          static_cast<std::size_t>(centers_m.rows() - first), r2_m2};
}

Result<MultiquadricSystem> MultiquadricSystem::factorise(const std::string& name, const Places& places, double r2_m2,
                                                         const RunControl& control) {
  FT_CHECK(r2_m2 > 0.0);
  FT_TRY_VOID(checkCenters(name, places, control));
  MultiquadricSystem system;
  system.name_ = name;
  system.r2_m2_ = r2_m2;
  system.centers_m_ = positionMatrix(places);
  if (!system.factoriseByCholesky())
    system.lu_.emplace(system.product(Eigen::MatrixXd::Identity(system.centers_m_.rows(), system.centers_m_.rows())));
  return system;
}

bool MultiquadricSystem::factoriseByCholesky() {
  const Eigen::Index n = centers_m_.rows();
  const Eigen::RowVector3d extent_m = centers_m_.colwise().maxCoeff() - centers_m_.colwise().minCoeff();
  const double c = kShiftOfLargest * std::sqrt(extent_m.squaredNorm() + r2_m2_);
  factor_.resize(n, n);
  // The lower triangle, column by column from the diagonal on; what lies above is never touched.
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d p_m = centers_m_.row(i).transpose();
    multiquadricWeights(arraysOf(centers_m_, r2_m2_, i), p_m.data(), &factor_(i, i));
    factor_.col(i).tail(n - i) = c - factor_.col(i).tail(n - i).array();
  }
  if (!choleskyInPlace(factor_)) return false;
  u_ = Eigen::MatrixXd::Ones(n, 1);
  choleskySolve(factor_, u_);
  // 1 - c 1^T u = -1/(c 1^T M^-1 1 - 1) is negative where the factors mean anything.
  const double share = 1.0 - c * u_.sum();
  k_ = c / share;
  return u_.allFinite() && share < 0.0;
}

Eigen::MatrixXd MultiquadricSystem::solveOnce(const Eigen::MatrixXd& values) const {
  if (lu_) return lu_->solve(values);
  Eigen::MatrixXd solution = values;
  choleskySolve(factor_, solution);
  return -(solution + k_ * u_ * solution.colwise().sum());
}

Eigen::MatrixXd MultiquadricSystem::product(const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd result(columns.rows(), columns.cols());
  Eigen::VectorXd w_m(columns.rows());
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    const Eigen::Vector3d p_m = centers_m_.row(i).transpose();
    multiquadricWeights(arraysOf(centers_m_, r2_m2_), p_m.data(), w_m.data());
    result.row(i).noalias() = w_m.transpose() * columns;
  }
  return result;
}

Result<Eigen::MatrixXd> MultiquadricSystem::solve(const Eigen::MatrixXd& values) const {
  FT_CHECK(values.rows() == centers_m_.rows());
  Eigen::MatrixXd alpha = solveOnce(values);
  if (!alpha.allFinite()) return spoiltByRounding(name_, r2_m2_);
  Eigen::MatrixXd both(alpha.rows(), 2 * alpha.cols());
  both << alpha, alpha.cwiseAbs();
  both = product(both);
  // Rounding error of f near the centres: alphas of both signs cancel, so eps times the sum of magnitudes.
  if (std::numeric_limits<double>::epsilon() * both.rightCols(alpha.cols()).maxCoeff() > kRoundingLimit_m)
    return spoiltByRounding(name_, r2_m2_);
  const Eigen::MatrixXd residual = values - both.leftCols(alpha.cols());
  if (residual.cwiseAbs().maxCoeff() > kResidualLimit_m) alpha += solveOnce(residual);
  if (!alpha.allFinite()) return spoiltByRounding(name_, r2_m2_);
  return alpha;
}

Eigen::MatrixXd MultiquadricSystem::takeInverse() && {
  if (lu_) return lu_->inverse();
  choleskyInverseInPlace(factor_);
  factor_.triangularView<Eigen::Lower>() = -(factor_ + k_ * u_ * u_.transpose());
  completeSymmetric(factor_);
  return std::move(factor_);
}

}  // namespace fieldtrue::correctors
