#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>

#include "calib/core/error.h"
#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {

/// What a polynomial is fitted to: a 3-vector at each position, tracker frame [m].
struct PolynomialProblem {
  std::string name;  ///< Stands in messages, e.g. "Polynomial of degree 4".
  std::span<const Eigen::Vector3d> p_m;
  std::span<const Eigen::Vector3d> value;
  int degree = 3;
  int dimension = 3;         ///< 3 volume; 2 plane: monomials of the two principal axes of p_m only.
  std::size_t n_places = 0;  ///< Distinct places among the rows.
  int fewest_levels = 0;     ///< Of the grid's axes, those with one level left out; 0 = the places are on no grid.
};

/// A vector polynomial of position: all monomials up to a degree of centred and scaled coordinates, three outputs.
class PolynomialField {
 public:
  static constexpr int kMaxDegree = 6;

  /// Number of monomials: (r+1)(r+2)(r+3)/6 in a volume, (r+1)(r+2)/2 in a plane.
  static int termCount(int dimension, int degree);

  /// Least squares by column-pivoted Householder QR. Normal equations (eq. 15) square the condition number, which at
  /// degree 6 leaves no correct digit.
  /// @error kDegenerate below two dimensions or when the positions do not determine the terms; kTooFewNodes
  /// @source survey by Kindratenko, eq. 14-15
  static Result<PolynomialField> fit(const PolynomialProblem& problem);

  Eigen::Vector3d value(const Eigen::Vector3d& p_m) const;
  /// d value / d p [1/m]: rows outputs, columns coordinates.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& p_m) const;
  /// Standard deviation of the value's 3-D error at a position: residual of the fit and what the fit itself adds.
  /// None when the fit leaves no residual to judge by.
  std::optional<double> standardError(const Eigen::Vector3d& p_m) const;

  int dimension() const { return dimension_; }
  int degree() const { return degree_; }
  int terms() const { return termCount(dimension_, degree_); }
  /// Ratio of smallest to largest pivot: near 1 well determined, below 1e-3 poorly.
  double pivotRatio() const { return pivot_ratio_; }

  nlohmann::json toJson() const;
  static PolynomialField fromJson(const JsonReader& json);

 private:
  friend class PolynomialHoldOut;

  PolynomialField() = default;
  void placeCoordinates(const PolynomialProblem& problem);
  Eigen::Vector3d localCoordinates(const Eigen::Vector3d& p_m) const;
  /// One row a position, one column a monomial.
  Eigen::MatrixXd designMatrix(std::span<const Eigen::Vector3d> p_m) const;

  int dimension_ = 3;
  int degree_ = 0;
  Eigen::Vector3d center_m_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  ///< Columns: directions of the local coordinates.
  Eigen::Vector3d scale_m_ = Eigen::Vector3d::Ones();
  Eigen::Matrix<double, Eigen::Dynamic, 3> coefficients_;  ///< One row a term.
  Eigen::MatrixXd inverse_root_;                           ///< F with F F^T = (X^T X)^-1, X the design matrix.
  double residual_sd_ = -1.0;                              ///< 3-D, degrees of freedom taken off; negative = none left.
  double pivot_ratio_ = 1.0;
};

}  // namespace fieldtrue::correctors
