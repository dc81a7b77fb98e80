#include "calib/correctors/hmq_field.h"

#include <cblas.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "calib/correctors/hmq_kernel.h"
#include "calib/correctors/json_values.h"

// LAPACK's own symbol, which OpenBLAS carries: Debian's single-threaded OpenBLAS package ships no LAPACKE header.
extern "C" void dgesv_(const int* n, const int* nrhs, double* a, const int* lda, int* ipiv, double* b, const int* ldb,
                       int* info);

namespace fieldtrue {
namespace {

constexpr std::size_t kMaxCenters = 10000;  // 800 MB for the matrix.
/// Largest rounding error of a value that is accepted [m]; four digits below what any tracker resolves.
constexpr double kRoundingLimit_m = 1e-6;
constexpr std::size_t kBlock = 256;

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

/// Rounding error of f near the centres: alphas of both signs cancel, so eps times the sum of magnitudes.
double roundingError(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& alpha) {
  const double largest = (matrix * alpha.cwiseAbs()).maxCoeff();
  return std::numeric_limits<double>::epsilon() * largest;
}

void useOneThread() {
  // calib starts no thread; where OpenBLAS is built with threads it must be told, once.
  static const bool told = [] {
    openblas_set_num_threads(1);
    return true;
  }();
  static_cast<void>(told);
}

}  // namespace

Result<MultiquadricField> MultiquadricField::fit(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                                 std::span<const int> node, const Eigen::MatrixXd& values, double r2_m2,
                                                 const RunControl& control) {
  const std::size_t count = centers_m.size();
  FT_CHECK(count > 0 && node.size() == count && static_cast<std::size_t>(values.rows()) == count && r2_m2 > 0.0);
  if (count > kMaxCenters)
    return fail(ErrorCode::kUnsupported, name + " takes at most " + std::to_string(kMaxCenters) + " places, got " +
                                             std::to_string(count) + "; use a polynomial");
  if (const auto repeated = findRepeated(centers_m))
    return fail(ErrorCode::kDegenerate,
                name + ": places " + std::to_string(node[repeated->first]) + " and " +
                    std::to_string(node[repeated->second]) +
                    " were tracked at exactly the same position, and one curve cannot pass through "
                    "both; measure one of them again or skip it");
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");

  MultiquadricField field;
  field.r2_m2_ = r2_m2;
  field.outputs_ = static_cast<std::size_t>(values.cols());
  for (const Eigen::Vector3d& p_m : centers_m) {
    field.x_m_.push_back(p_m.x());
    field.y_m_.push_back(p_m.y());
    field.z_m_.push_back(p_m.z());
  }
  const MultiquadricArrays arrays{field.x_m_.data(), field.y_m_.data(), field.z_m_.data(), count, r2_m2};
  Eigen::MatrixXd matrix(values.rows(), values.rows());
  for (std::size_t i = 0; i < count; ++i)
    multiquadricWeights(arrays, centers_m[i].data(), matrix.col(static_cast<Eigen::Index>(i)).data());

  useOneThread();
  Eigen::MatrixXd factors = matrix;
  Eigen::MatrixXd alpha = values;
  const int n = static_cast<int>(count);
  const int n_outputs = static_cast<int>(values.cols());
  std::vector<int> pivots(count);
  int info = 0;
  dgesv_(&n, &n_outputs, factors.data(), &n, pivots.data(), alpha.data(), &n, &info);
  if (info != 0 || !alpha.allFinite() || roundingError(matrix, alpha) > kRoundingLimit_m)
    return fail(ErrorCode::kDegenerate, name + ": the places stand so close together, compared with R = " +
                                            std::to_string(std::lround(std::sqrt(r2_m2) * 1000.0)) +
                                            " mm, that rounding spoils the solution; use a smaller R squared");
  field.alpha_.assign(alpha.data(), alpha.data() + alpha.size());
  return field;
}

void MultiquadricField::value(const Eigen::Vector3d& p_m, std::span<double> f) const {
  FT_CHECK(f.size() == outputs_);
  std::array<double, kBlock> w_m;
  std::fill(f.begin(), f.end(), 0.0);
  for (std::size_t start = 0; start < x_m_.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, x_m_.size() - start);
    const MultiquadricArrays block{x_m_.data() + start, y_m_.data() + start, z_m_.data() + start, count, r2_m2_};
    multiquadricWeights(block, p_m.data(), w_m.data());
    for (std::size_t k = 0; k < outputs_; ++k) f[k] += dotProduct(alpha(k) + start, w_m.data(), count);
  }
}

void MultiquadricField::value3(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  FT_CHECK(outputs_ == 3 && f.size() == p_m.size());
  if (p_m.empty()) return;
  const MultiquadricArrays arrays{x_m_.data(), y_m_.data(), z_m_.data(), x_m_.size(), r2_m2_};
  multiquadricSums(arrays, alpha(0), alpha(1), alpha(2), p_m.front().data(), p_m.size(), f.front().data());
}

Eigen::Matrix3d MultiquadricField::gradient3(const Eigen::Vector3d& p_m) const {
  FT_CHECK(outputs_ == 3);
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  for (std::size_t j = 0; j < x_m_.size(); ++j) {
    const Eigen::Vector3d from_center_m = p_m - Eigen::Vector3d(x_m_[j], y_m_[j], z_m_[j]);
    const Eigen::Vector3d alpha_j(alpha(0)[j], alpha(1)[j], alpha(2)[j]);
    gradient += alpha_j * from_center_m.transpose() / std::sqrt(from_center_m.squaredNorm() + r2_m2_);
  }
  return gradient;
}

nlohmann::json MultiquadricField::toJson() const {
  nlohmann::json centers = nlohmann::json::array();
  nlohmann::json alphas = nlohmann::json::array();
  for (std::size_t j = 0; j < x_m_.size(); ++j) {
    centers.push_back({x_m_[j], y_m_[j], z_m_[j]});
    nlohmann::json row = nlohmann::json::array();
    for (std::size_t k = 0; k < outputs_; ++k) row.push_back(alpha(k)[j]);
    alphas.push_back(std::move(row));
  }
  return {{"r2_m2", r2_m2_}, {"centers_m", std::move(centers)}, {"alpha", std::move(alphas)}};
}

MultiquadricField MultiquadricField::fromJson(const nlohmann::json& json, std::size_t outputs) {
  const Eigen::MatrixXd centers = matrixFrom(json.at("centers_m"), 3);
  const Eigen::MatrixXd alphas = matrixFrom(json.at("alpha"), static_cast<Eigen::Index>(outputs));
  MultiquadricField field;
  field.r2_m2_ = json.at("r2_m2").get<double>();
  field.outputs_ = outputs;
  if (centers.rows() != alphas.rows() || centers.rows() == 0 || !(field.r2_m2_ > 0.0))
    throwMalformed("as many coefficients as centres and a positive r2_m2 are needed");
  field.x_m_.assign(centers.col(0).begin(), centers.col(0).end());
  field.y_m_.assign(centers.col(1).begin(), centers.col(1).end());
  field.z_m_.assign(centers.col(2).begin(), centers.col(2).end());
  field.alpha_.assign(alphas.data(), alphas.data() + alphas.size());
  return field;
}

}  // namespace fieldtrue
