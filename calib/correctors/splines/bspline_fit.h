#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/pose.h"
#include "calib/core/run_control.h"
#include "calib/correctors/splines/bspline_lattice.h"

namespace fieldtrue::correctors {

/// What a smoothing spline is fitted to. @param y, x displacements and tracked positions, one row a place [m]
struct SplineProblem {
  SplineLattice lattice;
  std::vector<Eigen::Vector3d> p_m;
  Eigen::MatrixXd y;
  Eigen::MatrixXd x;
  Eigen::VectorXd weight;  ///< One over the noise variance of each place, in units of the mean.
};

/// Penalised least squares: minimises sum w_i |y_i - f(p_i)|^2 + lambda * bending penalty, linear fields unpenalised.
class SmoothingSpline {
 public:
  /// @return none when the places do not determine a linear field
  static std::optional<SmoothingSpline> of(SplineProblem problem);

  /// Generalised cross-validation's score of a smoothing, and the effective number of parameters.
  struct Score {
    double gcv = 0.0;
    double degrees_of_freedom = 0.0;
  };
  /// @param smoothing lambda over the ratio of the traces of the data's matrix and the penalty's
  /// @source Golub, Heath, Wahba 1979; Eilers, Marx 1996
  std::optional<Score> score(double smoothing) const;

  /// The smoothing of least score: a grid in log space, then finer steps around its best.
  /// @return none on a request to stop or when no smoothing can be solved for
  std::optional<double> choose(const RunControl& control) const;

  /// Solves for one smoothing; the following need it. @return false when rounding spoils it
  [[nodiscard]] bool solve(double smoothing);
  const SplineLattice& lattice() const { return problem_.lattice; }
  double degreesOfFreedom() const { return degrees_of_freedom_; }

  /// The field without some places, for truth moved by `fold_from_data`.
  /// @param out ascending
  /// @return none when the rest does not determine it
  std::optional<SplineField> without(std::span<const std::size_t> out, const Pose& fold_from_data) const;

 private:
  SmoothingSpline() = default;
  struct Solved {
    Eigen::MatrixXd inverse;  ///< Of the normal matrix, lower triangle.
    Eigen::MatrixXd coefficients;
    Eigen::MatrixXd residual;
    double degrees_of_freedom = 0.0;
  };
  std::optional<Solved> solved(double smoothing) const;
  Eigen::MatrixXd valuesAtPlaces(const Eigen::MatrixXd& coefficients) const;

  SplineProblem problem_;
  std::vector<SplineWeights> basis_;  ///< At each place.
  Eigen::MatrixXd gram_;              ///< B^T W B, lower triangle.
  Eigen::MatrixXd penalty_;           ///< Scaled to the trace of gram_.
  Eigen::MatrixXd trend_;             ///< Of [y x], taken off before.
  Eigen::MatrixXd detrended_;         ///< [y x] without it.
  Eigen::MatrixXd right_;             ///< B^T W [y x], without the trend.
  Eigen::MatrixXd inverse_, coefficients_, residual_;
  double degrees_of_freedom_ = 0.0;
};

}  // namespace fieldtrue::correctors
