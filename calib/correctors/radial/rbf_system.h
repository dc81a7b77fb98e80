#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/correctors/base/hold_out_rows.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// Splits values at places into what a linear tail can follow and the rest: H = Q1 R, and Q2 spans what H does not.
/// Kept as Householder's Q = I - V T V^T, so that no n by n orthogonal matrix is formed.
class TailProjection {
 public:
  /// @param tail FieldFrame::tail, or its rows times weights; more rows than columns
  /// @return none when the places do not determine the tail
  static std::optional<TailProjection> of(const Eigen::MatrixXd& tail);

  Eigen::Index rows() const { return v_.rows(); }
  Eigen::Index tailSize() const { return v_.cols(); }
  /// Q2^T A Q2, in the lower triangle. @param a symmetric, lower triangle given
  Eigen::MatrixXd projected(const Eigen::MatrixXd& a) const;
  /// Q2 G Q2^T, in the lower triangle. @param g symmetric, lower triangle given
  Eigen::MatrixXd lifted(const Eigen::MatrixXd& g) const;
  /// Q2^T Y
  Eigen::MatrixXd toComplement(const Eigen::MatrixXd& values) const;
  /// Q2 Z
  Eigen::MatrixXd fromComplement(const Eigen::MatrixXd& values) const;
  /// Q1^T Y
  Eigen::MatrixXd toTail(const Eigen::MatrixXd& values) const;
  /// R^-1 Q1^T Y: the tail fitted to values.
  Eigen::MatrixXd tailOf(const Eigen::MatrixXd& values) const;
  /// Q1 R^-T h: weights of the places whose tail is h, smallest in norm.
  Eigen::VectorXd weightsOf(const Eigen::VectorXd& h) const;
  /// Q1
  Eigen::MatrixXd tailBasis() const;
  /// R^-T h
  Eigen::VectorXd tailCoordinates(const Eigen::VectorXd& h) const;

 private:
  Eigen::MatrixXd v_, t_, r_;
};

/// Solves A c + H t = Y with H^T c = 0. @param a symmetric, lower triangle given, positive definite on what H leaves
/// @param factor if not null: the Cholesky factor of Q2^T A Q2
/// @return none when it is not positive definite to rounding
std::optional<RadialSolution> solveRadial(const TailProjection& projection, const Eigen::MatrixXd& a,
                                          const Eigen::MatrixXd& y, Eigen::MatrixXd* factor = nullptr);

/// The inverse of that system, and with it every solution that leaves places out.
class RadialHoldOut {
 public:
  /// @param a as for solveRadial; @param y true minus tracked positions [m]; @param x tracked positions [m]
  /// @return none when the system is not positive definite to rounding
  static std::optional<RadialHoldOut> of(const TailProjection& projection, const Eigen::MatrixXd& a,
                                         const Eigen::MatrixXd& y, const Eigen::MatrixXd& x);

  /// The solution without some places, for truth moved by `fold_from_data`; rows of the places left out are removed.
  /// @param out ascending
  /// @return none when the rest does not determine it
  std::optional<RadialSolution> without(std::span<const std::size_t> out, const Pose& fold_from_data) const;

  /// Error at each place of the fit without it: Rippa's c_i / (A^-1)_ii.
  /// @source Rippa 1999, An algorithm for selecting a good value for the parameter c in radial basis function
  ///         interpolation, eq. 17; here with the tail and smoothing inside A
  Eigen::MatrixXd leaveOneOutErrors() const;

  /// Error at some places of the fit without any of them, one row a place. @param out ascending
  /// @return none when the rest does not determine it
  std::optional<Eigen::MatrixXd> leftOutErrors(std::span<const std::size_t> out) const;

 private:
  std::optional<Eigen::MatrixXd> leftOutErrors(std::span<const std::size_t> out,
                                               const Eigen::MatrixXd& coefficients) const;

  Eigen::MatrixXd inverse_;       ///< P: c = P Y.
  Eigen::MatrixXd tail_inverse_;  ///< B: t = B^T Y.
  RadialSolution of_y_, of_x_;
};

/// Displacements, true minus tracked: one row a place [m].
Eigen::MatrixXd displacementMatrix(const Places& places);

/// Checks data for a smooth fit and merges its places.
/// @error as checkPositions; kDegenerate below a plane; kTooFewNodes below two more places than a linear field has
/// terms
Result<Places> smoothFitPlaces(const FitData& data, const std::string& name);

/// That the places do not determine a linear field.
Error degenerateTail(const std::string& name, std::size_t n_places);

}  // namespace fieldtrue::correctors
