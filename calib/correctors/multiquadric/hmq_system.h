#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"

namespace fieldtrue::correctors {

/// What every multiquadric asks of its centres first, and of OpenBLAS: one thread.
/// @error kDegenerate when two centres coincide; kUnsupported beyond 10,000; kCancelled
Result<void> checkMultiquadricCenters(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                      std::span<const int> node, std::span<const std::array<int, 3>> index,
                                      const RunControl& control);

/// c for which c 1 1^T - M is positive definite, with room: four times the largest entry that M may have.
double multiquadricShift(std::span<const Eigen::Vector3d> centers_m, double r2_m2);

/// The factorised system of equations M alpha = values, M_ij = w_j(p_i), through centres at scattered positions.
///
/// M has one positive eigenvalue and otherwise negative ones (Micchelli 1986), so A = c 1 1^T - M is positive definite
/// for a large enough c, and Cholesky's factors of A take half the work of LU factors of M. Where rounding hides that
/// (places very close together compared with R), LU factors are taken.
/// @source survey by Kindratenko, section 3.5, eq. 18
class MultiquadricSystem {
 public:
  /// @param name stands in messages
  /// @param centers_m tracked positions, tracker frame [m]
  /// @param node place of each centre, for messages
  /// @param index its grid index; empty for scattered places
  /// @error kDegenerate when two centres coincide or the system cannot be factorised; kUnsupported beyond 10,000
  ///        centres; kCancelled
  static Result<MultiquadricSystem> factorise(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                              std::span<const int> node, std::span<const std::array<int, 3>> index,
                                              double r2_m2, const RunControl& control);

  std::size_t size() const { return centers_m_.size(); }
  double r2_m2() const { return r2_m2_; }
  std::span<const Eigen::Vector3d> centers_m() const { return centers_m_; }

  /// Coefficients through values, one column an output, improved once by their own residual where that exceeds
  /// a tenth of a nanometre.
  /// @error kDegenerate when rounding would exceed a micrometre (or a millionth, where the values are no lengths)
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& values) const;

  /// M^-1, symmetric. Replaces the factors: nothing else can be asked afterwards.
  Eigen::MatrixXd takeInverse() &&;
  /// The diagonal of M^-1. Replaces the factors: nothing else can be asked afterwards.
  Eigen::VectorXd takeInverseDiagonal() &&;

 private:
  MultiquadricSystem() = default;
  bool factoriseByCholesky();
  bool solveForOnes();
  bool factoriseByLu();
  /// M^-1 from the inverse of A (Sherman and Morrison): -(A^-1 + k u u^T), u = A^-1 1.
  double shermanMorrison() const;
  Eigen::MatrixXd solveOnce(const Eigen::MatrixXd& values) const;
  /// M times columns, each entry of M made anew.
  Eigen::MatrixXd product(const Eigen::MatrixXd& columns) const;

  std::string name_;
  std::vector<Eigen::Vector3d> centers_m_;
  std::vector<double> x_m_, y_m_, z_m_;
  double r2_m2_ = 0.0;
  bool by_cholesky_ = true;
  double shift_ = 0.0;  ///< c.
  Eigen::MatrixXd factors_;
  Eigen::VectorXd u_;  ///< A^-1 1, with Cholesky's factors.
  std::vector<int> pivots_;
};

}  // namespace fieldtrue::correctors
