#include "calib/correctors/multiquadric/hmq_mixed.h"

#include <cmath>
#include <limits>

#include "calib/core/error.h"
#include "calib/correctors/multiquadric/hmq_field.h"
#include "calib/correctors/multiquadric/hmq_kernel.h"
#include "calib/correctors/multiquadric/hmq_system.h"
#include "calib/correctors/numerics/aligned_vector.h"

extern "C" {
void spotrf_(const char* uplo, const int* n, float* a, const int* lda, int* info);
void spotrs_(const char* uplo, const int* n, const int* nrhs, const float* a, const int* lda, float* b, const int* ldb,
             int* info);
}

namespace fieldtrue::correctors {
namespace {

constexpr double kResidualLimit_m = 1e-10;
/// An improvement that gains less is lost in rounding.
constexpr double kLeastGain = 3.0;
constexpr int kMostImprovements = 12;

/// The factors, and an approximate solution from them.
class SingleFactors {
 public:
  bool factorise(std::span<const Eigen::Vector3d> centers_m, const MultiquadricArrays& arrays) {
    n_ = static_cast<int>(arrays.count);
    shift_ = multiquadricShift(centers_m, arrays.r2_m2);
    factors_.resize(n_, n_);
    Eigen::VectorXd w_m(n_);
    for (std::size_t i = 0; i < arrays.count; ++i) {
      const MultiquadricArrays below{arrays.x_m + i, arrays.y_m + i, arrays.z_m + i, arrays.count - i, arrays.r2_m2};
      multiquadricWeights(below, centers_m[i].data(), w_m.data());
      const auto at = static_cast<Eigen::Index>(i);
      factors_.col(at).tail(n_ - at) = (shift_ - w_m.head(n_ - at).array()).cast<float>();
    }
    int info = 0;
    spotrf_("L", &n_, factors_.data(), &n_, &info);
    if (info != 0) return false;
    u_ = inverseTimes(Eigen::VectorXd::Ones(n_));
    const double share = 1.0 - shift_ * u_.sum();
    sherman_morrison_ = shift_ / share;
    return u_.allFinite() && share < 0.0;
  }

  /// -(A^-1 + k u u^T) v, which is nearly M^-1 v.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& values) const {
    const Eigen::MatrixXd solution = inverseTimes(values);
    const Eigen::RowVectorXd sums = solution.colwise().sum();
    return -(solution + sherman_morrison_ * u_ * sums);
  }

 private:
  Eigen::MatrixXd inverseTimes(const Eigen::MatrixXd& values) const {
    // Residuals of nanometres are within single precision's range, and their digits count from the first.
    Eigen::MatrixXf solution = values.cast<float>();
    const auto n_outputs = static_cast<int>(values.cols());
    int info = 0;
    spotrs_("L", &n_, &n_outputs, factors_.data(), &n_, solution.data(), &n_, &info);
    return solution.cast<double>();
  }

  int n_ = 0;
  double shift_ = 0.0;
  double sherman_morrison_ = 0.0;
  Eigen::MatrixXf factors_;
  Eigen::VectorXd u_;
};

}  // namespace

std::optional<Eigen::MatrixXd> solveMultiquadricMixed(std::span<const Eigen::Vector3d> centers_m, double r2_m2,
                                                      const Eigen::MatrixXd& values) {
  FT_CHECK(values.cols() == 3 && static_cast<std::size_t>(values.rows()) == centers_m.size());
  AlignedVector<double> x_m, y_m, z_m;
  for (const Eigen::Vector3d& p_m : centers_m) {
    x_m.push_back(p_m.x());
    y_m.push_back(p_m.y());
    z_m.push_back(p_m.z());
  }
  const MultiquadricArrays arrays{x_m.data(), y_m.data(), z_m.data(), centers_m.size(), r2_m2};
  SingleFactors factors;
  if (!factors.factorise(centers_m, arrays)) return std::nullopt;
  Eigen::MatrixXd alpha = factors.solve(values);
  double last_m = HUGE_VAL;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> f(values.rows(), 3);
  for (int improvement = 0; improvement < kMostImprovements; ++improvement) {
    multiquadricSums(arrays, alpha.col(0).data(), alpha.col(1).data(), alpha.col(2).data(), centers_m.front().data(),
                     centers_m.size(), f.data());
    const Eigen::MatrixXd residual = values - f;
    const double largest_m = residual.cwiseAbs().maxCoeff();
    if (largest_m <= kResidualLimit_m) return alpha;
    if (!(largest_m < last_m / kLeastGain)) return std::nullopt;
    last_m = largest_m;
    alpha += factors.solve(residual);
  }
  return std::nullopt;
}

}  // namespace fieldtrue::correctors
