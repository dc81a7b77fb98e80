#include "calib/correctors/multiquadric/hmq_system.h"

#include <cblas.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "calib/core/place_name.h"
#include "calib/correctors/multiquadric/hmq_kernel.h"

// LAPACK's own symbols, which OpenBLAS carries: Debian's single-threaded OpenBLAS package ships no LAPACKE header.
extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dpotrs_(const char* uplo, const int* n, const int* nrhs, const double* a, const int* lda, double* b,
             const int* ldb, int* info);
void dpotri_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dtrtri_(const char* uplo, const char* diag, const int* n, double* a, const int* lda, int* info);
void dgetrf_(const int* m, const int* n, double* a, const int* lda, int* ipiv, int* info);
void dgetrs_(const char* trans, const int* n, const int* nrhs, const double* a, const int* lda, const int* ipiv,
             double* b, const int* ldb, int* info);
void dgetri_(const int* n, double* a, const int* lda, const int* ipiv, double* work, const int* lwork, int* info);
}

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kMaxCenters = 10000;  // 800 MB for the matrix.
/// Largest rounding error of a value that is accepted [m]; four digits below what any tracker resolves.
constexpr double kRoundingLimit_m = 1e-6;
/// Largest residual that is left as it is [m]; a larger one improves the solution once.
constexpr double kResidualLimit_m = 1e-10;
/// c over the largest entry that M may have: 1/(1^T M^-1 1), which c must exceed, was at most 1.3 of that entry for
/// grids of 125 to 1728 places and R^2 from 10 to 1000 cm2 wherever M could be solved at all.
constexpr double kShiftOfLargest = 4.0;

/// Two centres at exactly the same position, as indices.
std::optional<std::pair<std::size_t, std::size_t>> findRepeated(std::span<const Eigen::Vector3d> centers_m) {
  std::vector<std::size_t> order(centers_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto less = [&](std::size_t a, std::size_t b) {
    return std::lexicographical_compare(centers_m[a].begin(), centers_m[a].end(), centers_m[b].begin(),
                                        centers_m[b].end());
  };
  std::sort(order.begin(), order.end(), less);
  for (std::size_t i = 1; i < order.size(); ++i)
    if (centers_m[order[i - 1]] == centers_m[order[i]])
      return std::pair{std::min(order[i - 1], order[i]), std::max(order[i - 1], order[i])};
  return std::nullopt;
}

tl::unexpected<Error> spoiltByRounding(const std::string& name, double r2_m2) {
  return fail(ErrorCode::kDegenerate, name + ": the places stand so close together, compared with R = " +
                                          std::to_string(std::lround(std::sqrt(r2_m2) * 1000.0)) +
                                          " mm, that rounding spoils the solution; use a smaller R squared");
}

}  // namespace

double multiquadricShift(std::span<const Eigen::Vector3d> centers_m, double r2_m2) {
  Eigen::Vector3d low_m = centers_m.front();
  Eigen::Vector3d high_m = low_m;
  for (const Eigen::Vector3d& p_m : centers_m) {
    low_m = low_m.cwiseMin(p_m);
    high_m = high_m.cwiseMax(p_m);
  }
  return kShiftOfLargest * std::sqrt((high_m - low_m).squaredNorm() + r2_m2);
}

Result<void> checkMultiquadricCenters(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                      std::span<const int> node, std::span<const std::array<int, 3>> index,
                                      const RunControl& control) {
  FT_CHECK(!centers_m.empty() && node.size() == centers_m.size());
  if (centers_m.size() > kMaxCenters)
    return fail(ErrorCode::kUnsupported, name + " takes at most " + std::to_string(kMaxCenters) + " places, got " +
                                             std::to_string(centers_m.size()) + "; use a polynomial");
  if (const auto repeated = findRepeated(centers_m))
    return fail(ErrorCode::kDegenerate,
                name + ": " + PlaceNames(node, index).of(node[repeated->first]) + " and " +
                    PlaceNames(node, index).of(node[repeated->second]) +
                    " were tracked at exactly the same position, and one curve cannot pass through "
                    "both; measure one of them again or skip it");
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  // calib starts no thread; where OpenBLAS is built with threads it must be told, once.
  static const bool told = [] {
    openblas_set_num_threads(1);
    return true;
  }();
  static_cast<void>(told);
  return {};
}

Result<MultiquadricSystem> MultiquadricSystem::factorise(const std::string& name,
                                                         std::span<const Eigen::Vector3d> centers_m,
                                                         std::span<const int> node,
                                                         std::span<const std::array<int, 3>> index, double r2_m2,
                                                         const RunControl& control) {
  FT_CHECK(r2_m2 > 0.0);
  FT_TRY_VOID(checkMultiquadricCenters(name, centers_m, node, index, control));
  MultiquadricSystem system;
  system.name_ = name;
  system.r2_m2_ = r2_m2;
  system.centers_m_.assign(centers_m.begin(), centers_m.end());
  for (const Eigen::Vector3d& p_m : centers_m) {
    system.x_m_.push_back(p_m.x());
    system.y_m_.push_back(p_m.y());
    system.z_m_.push_back(p_m.z());
  }
  if (!(system.factoriseByCholesky() && system.solveForOnes()) && !system.factoriseByLu())
    return spoiltByRounding(name, r2_m2);
  return system;
}

bool MultiquadricSystem::factoriseByCholesky() {
  const auto n = static_cast<int>(size());
  factors_.resize(n, n);
  shift_ = multiquadricShift(centers_m_, r2_m2_);
  // The lower triangle, column by column from the diagonal on; what lies above is never touched.
  for (std::size_t i = 0; i < size(); ++i) {
    const MultiquadricArrays below{x_m_.data() + i, y_m_.data() + i, z_m_.data() + i, size() - i, r2_m2_};
    const auto at = static_cast<Eigen::Index>(i);
    multiquadricWeights(below, centers_m_[i].data(), &factors_(at, at));
    factors_.col(at).tail(n - at) = shift_ - factors_.col(at).tail(n - at).array();
  }
  int info = 0;
  dpotrf_("L", &n, factors_.data(), &n, &info);
  return info == 0;
}

bool MultiquadricSystem::solveForOnes() {
  const auto n = static_cast<int>(size());
  const int one = 1;
  int info = 0;
  u_ = Eigen::VectorXd::Ones(n);
  dpotrs_("L", &n, &one, factors_.data(), &n, u_.data(), &n, &info);
  // 1 - c 1^T u = -1/(c 1^T M^-1 1 - 1) is negative where the factors mean anything.
  return info == 0 && u_.allFinite() && 1.0 - shift_ * u_.sum() < 0.0;
}

bool MultiquadricSystem::factoriseByLu() {
  by_cholesky_ = false;
  const auto n = static_cast<int>(size());
  const MultiquadricArrays all{x_m_.data(), y_m_.data(), z_m_.data(), size(), r2_m2_};
  for (std::size_t i = 0; i < size(); ++i)
    multiquadricWeights(all, centers_m_[i].data(), factors_.col(static_cast<Eigen::Index>(i)).data());
  pivots_.resize(size());
  int info = 0;
  dgetrf_(&n, &n, factors_.data(), &n, pivots_.data(), &info);
  return info == 0;
}

double MultiquadricSystem::shermanMorrison() const { return shift_ / (1.0 - shift_ * u_.sum()); }

Eigen::MatrixXd MultiquadricSystem::solveOnce(const Eigen::MatrixXd& values) const {
  const auto n = static_cast<int>(size());
  const auto n_outputs = static_cast<int>(values.cols());
  Eigen::MatrixXd solution = values;
  int info = 0;
  if (!by_cholesky_) {
    dgetrs_("N", &n, &n_outputs, factors_.data(), &n, pivots_.data(), solution.data(), &n, &info);
    return solution;
  }
  dpotrs_("L", &n, &n_outputs, factors_.data(), &n, solution.data(), &n, &info);
  const Eigen::RowVectorXd sums = solution.colwise().sum();
  return -(solution + shermanMorrison() * u_ * sums);
}

Eigen::MatrixXd MultiquadricSystem::product(const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd result(columns.rows(), columns.cols());
  const MultiquadricArrays all{x_m_.data(), y_m_.data(), z_m_.data(), size(), r2_m2_};
  Eigen::VectorXd w_m(columns.rows());
  for (std::size_t i = 0; i < size(); ++i) {
    multiquadricWeights(all, centers_m_[i].data(), w_m.data());
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      result(static_cast<Eigen::Index>(i), k) = dotProduct(columns.col(k).data(), w_m.data(), size());
  }
  return result;
}

Result<Eigen::MatrixXd> MultiquadricSystem::solve(const Eigen::MatrixXd& values) const {
  FT_CHECK(static_cast<std::size_t>(values.rows()) == size() && factors_.size() > 0);
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
  const auto n = static_cast<int>(size());
  int info = 0;
  if (!by_cholesky_) {
    const int work_size = 64 * n;
    std::vector<double> work(static_cast<std::size_t>(work_size));
    dgetri_(&n, factors_.data(), &n, pivots_.data(), work.data(), &work_size, &info);
    FT_CHECK(info == 0);
    return std::move(factors_);
  }
  dpotri_("L", &n, factors_.data(), &n, &info);
  FT_CHECK(info == 0);
  const double k = shermanMorrison();
  for (Eigen::Index j = 0; j < n; ++j) {
    factors_.col(j).tail(n - j) = -(factors_.col(j).tail(n - j) + k * u_[j] * u_.tail(n - j));
    factors_.row(j).tail(n - j) = factors_.col(j).tail(n - j).transpose();
  }
  return std::move(factors_);
}

Eigen::VectorXd MultiquadricSystem::takeInverseDiagonal() && {
  if (!by_cholesky_) return std::move(*this).takeInverse().diagonal();
  const auto n = static_cast<int>(size());
  int info = 0;
  dtrtri_("L", "N", &n, factors_.data(), &n, &info);
  FT_CHECK(info == 0);
  // A^-1 = L^-T L^-1: its diagonal holds the squared lengths of the columns of L^-1.
  const double k = shermanMorrison();
  Eigen::VectorXd diagonal(n);
  for (Eigen::Index j = 0; j < n; ++j) diagonal[j] = -(factors_.col(j).tail(n - j).squaredNorm() + k * u_[j] * u_[j]);
  return diagonal;
}

}  // namespace fieldtrue::correctors
