#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/core/run_control.h"

namespace fieldtrue::correctors {

/// Unknowns of one candidate source: the symmetric tensor of what it answers.
inline constexpr Eigen::Index kPerSource = 6;

/// A linear model y = A u + noise of unit variance whose unknowns come in groups of kPerSource, as its normal
/// equations.
struct GroupedSystem {
  Eigen::MatrixXd gram;    ///< A^T A, both triangles.
  Eigen::VectorXd right;   ///< A^T y.
  double y_squared = 0.0;  ///< y^T y.
  double n_rows = 0.0;     ///< Rows less the nuisance unknowns already projected out.
  double unit_m = 1.0;     ///< Amplitudes of this size are large; prior variances are looked for below its square.

  Eigen::Index groups() const { return right.size() / kPerSource; }
};

/// What decides how many groups enter.
struct GroupSelectionOptions {
  double least_gain = 6.0;  ///< Log evidence a further group must add [nats].
  std::size_t most_groups = 40;
  double noise_factor = 1.0;   ///< Variance of the noise in units of the one stated.
  bool noise_unknown = false;  ///< Found anew after every group, starting from y itself.
};

/// The groups chosen, and the posterior of their unknowns.
struct GroupSelection {
  std::vector<Eigen::Index> groups;
  Eigen::VectorXd prior_variance;  ///< Of each group's amplitudes.
  Eigen::VectorXd amplitudes;      ///< kPerSource for each group, in the order of `groups`.
  Eigen::VectorXd gain;            ///< Of every group of the system, were it added next [nats]; 0 of those chosen.
  double noise_factor = 1.0;       ///< As the residual shows it.
};

/// Adds groups one by one, always the one whose addition raises the marginal likelihood most, and finds the prior
/// variance of each anew after every step, until no group adds the least gain. Few sources explain most rooms; a room
/// without metal gets none.
/// @source Tipping and Faul 2003, Fast marginal likelihood maximisation for sparse Bayesian models; the variances:
/// MacKay 1992, Bayesian interpolation, Neural Computation 4 415
GroupSelection selectGroups(const GroupedSystem& system, const GroupSelectionOptions& options,
                            const RunControl& control);

}  // namespace fieldtrue::correctors
