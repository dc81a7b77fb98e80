#pragma once

#include <Eigen/LU>
#include <optional>
#include <string>

#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/multiquadric/hmq_kernel.h"

namespace fieldtrue::correctors {

/// Largest rounding error of a value that is accepted [m]; four digits below what any tracker resolves.
inline constexpr double kRoundingLimit_m = 1e-6;

/// Centres, one row each, from the first on. @param centers_m n x 3, column by column in memory; must outlive the
/// arrays
MultiquadricArrays arraysOf(const Eigen::MatrixX3d& centers_m, double r2_m2, Eigen::Index first = 0);

/// The factorised system of equations M alpha = values, M_ij = w_j(p_i), through centres at scattered positions.
///
/// M has one positive eigenvalue and otherwise negative ones (Micchelli 1986), so A = c 1 1^T - M is positive definite
/// for a large enough c, and Cholesky's factors of A take half the work of LU factors of M. Where rounding hides that
/// (places very close together compared with R), LU factors are taken.
/// @source survey by Kindratenko, section 3.5, eq. 18
class MultiquadricSystem {
 public:
  /// Through the tracked positions of places.
  /// @param name stands in messages
  /// @error kDegenerate when two places were tracked at one position; kUnsupported beyond 10,000; kCancelled
  static Result<MultiquadricSystem> factorise(const std::string& name, const Places& places, double r2_m2,
                                              const RunControl& control);

  const Eigen::MatrixX3d& centers_m() const { return centers_m_; }

  /// Coefficients through values, one column an output, improved once by their own residual where that exceeds
  /// a tenth of a nanometre.
  /// @error kDegenerate when rounding would exceed a micrometre (or a millionth, where the values are no lengths)
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& values) const;

  /// M^-1, symmetric. Replaces the factors: nothing else can be asked afterwards.
  Eigen::MatrixXd takeInverse() &&;

 private:
  MultiquadricSystem() = default;
  bool factoriseByCholesky();
  Eigen::MatrixXd solveOnce(const Eigen::MatrixXd& values) const;
  /// M times columns, each row of M made anew.
  Eigen::MatrixXd product(const Eigen::MatrixXd& columns) const;

  std::string name_;
  Eigen::MatrixX3d centers_m_;
  double r2_m2_ = 0.0;
  Eigen::MatrixXd factor_;                                  ///< Cholesky's, of A; later M^-1.
  Eigen::MatrixXd u_;                                       ///< A^-1 1, one column.
  double k_ = 0.0;                                          ///< M^-1 = -(A^-1 + k u u^T), by Sherman and Morrison.
  std::optional<Eigen::PartialPivLU<Eigen::MatrixXd>> lu_;  ///< Of M, in place of Cholesky's.
};

}  // namespace fieldtrue::correctors
