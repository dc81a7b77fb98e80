#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calib/identify/linearized_model.h"

namespace fieldtrue::identify {

/// How whitened residuals are distributed: per row and kind (position, rotation) a Student t of three dimensions with
/// an unknown scale; many degrees of freedom are a normal distribution.
struct ResidualLaw {
  double degrees_of_freedom = 100.0;
};

/// Scales of the whitened residuals: 1 where the stated noise is right.
struct ResidualScale {
  double position = 1.0;
  double rotation = 1.0;
};

/// Minus twice the log likelihood of whitened residuals with the scales that fit them best.
/// @source Student t with unknown scale: Lange, Little, Taylor 1989, JASA 84 881
struct Deviance {
  double value = 0.0;
  ResidualScale scale;
};
Deviance devianceOf(std::span<const Vector6d> whitened, bool has_orientation, const ResidualLaw& law);
/// Of tails with 4, 8 and 100 degrees of freedom.
ResidualLaw likeliestLaw(std::span<const Vector6d> whitened, bool has_orientation);

/// Whitened residuals of a model, one per row.
std::vector<Vector6d> whitenedResiduals(const GapPhysics& physics, const GapModel& model, const Whitening& whitening);

/// Minus twice the log prior of a model: the rig's stated tolerances, and what is believable of linear effects.
double priorCost(const GapPhysics& physics, const GapModel& model);

struct LocalFit {
  Eigen::VectorXd searched;
  Eigen::VectorXd linear;
  double gain = 0.0;  ///< Fall of the sum of squares of the rows used.
};

/// Refines the searched parameters of fits near their starts by Levenberg and Marquardt, all linear parameters and the
/// nuisance projected out.
/// @source variable projection: Golub and Pereyra 1973, SIAM J. Numer. Anal. 10 413
class LocalFitter {
 public:
  /// @param at outlives it
  /// @param held_out block left out; none = all rows
  explicit LocalFitter(const Linearized& at, std::optional<std::size_t> held_out = std::nullopt);

  LocalFit from(const effects::EffectFit& fit, const Eigen::VectorXd& start) const;

  /// Columns of a fit on the rows that count, less what the nuisance makes of them; and the residual likewise.
  Eigen::MatrixXd columns(const effects::EffectFit& fit, const Eigen::VectorXd& searched) const;
  const Eigen::VectorXd& residual() const { return residual_; }

 private:
  Eigen::MatrixXd picked(Eigen::MatrixXd all) const;
  Eigen::MatrixXd projected(const Eigen::MatrixXd& m) const { return m - basis_ * (basis_.transpose() * m); }

  const Linearized& at_;
  std::vector<Segment> parts_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd residual_;
};

}  // namespace fieldtrue::identify
