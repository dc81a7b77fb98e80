#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/polynomial/polynomial_field.h"

namespace fieldtrue::correctors {

/// A linear change of the values of a polynomial problem: value = of_value * value + of_position * p + constant.
struct ValueChange {
  Eigen::Matrix3d of_value = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d of_position = Eigen::Matrix3d::Zero();
  Eigen::Vector3d constant = Eigen::Vector3d::Zero();
};

/// Least-squares polynomials with rows left out, from one factorisation of the fit to all rows. With Q the orthonormal
/// base of the design matrix X = Q F^-1 and e the residuals of the fit to all,
/// beta_without_B = beta - F Q_B^T (I - Q_B Q_B^T)^-1 e_B.
/// @source Cook and Weisberg 1982, Residuals and Influence in Regression, section 3.2
class PolynomialHoldOut {
 public:
  /// Copies what it needs of the problem.
  /// @param places of the problem's rows
  /// @error as PolynomialField::fit
  static Result<PolynomialHoldOut> make(const PolynomialProblem& problem, Places places);

  /// The polynomial of the other rows, their values changed. Local coordinates and, in a plane, its axes stay those of
  /// all rows.
  /// @param rows left out, ascending
  /// @error as PolynomialField::fit of the rest
  Result<PolynomialField> without(std::span<const std::size_t> rows, const ValueChange& change) const;

  /// Of each place the squared 3-D error, mean over its rows, of the polynomial fitted without it.
  /// @return none when a place cannot be left out
  std::optional<std::vector<double>> leaveOneOutSquares() const;

 private:
  explicit PolynomialHoldOut(PolynomialField field) : field_(std::move(field)) {}
  Result<PolynomialField> refit(std::span<const std::size_t> rows, const ValueChange& change) const;
  Eigen::MatrixXd baseOf(std::span<const std::size_t> rows) const;

  PolynomialField field_;
  Places places_;
  std::string name_;
  std::vector<Eigen::Vector3d> p_m_;
  std::vector<Eigen::Vector3d> value_;
  Eigen::MatrixXd base_;                                            ///< Q, one row a row of the problem.
  Eigen::Matrix<double, Eigen::Dynamic, 3> position_coefficients_;  ///< Of p itself, as a polynomial.
  Eigen::Matrix<double, Eigen::Dynamic, 6> residuals_;              ///< Of the values and of p.
  Eigen::Matrix<double, 6, 6> residual_squares_;                    ///< residuals_^T residuals_.
};

}  // namespace fieldtrue::correctors
