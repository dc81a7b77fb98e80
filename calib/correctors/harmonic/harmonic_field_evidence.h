#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/core/run_control.h"

namespace fieldtrue::correctors {

/// Unknowns of one candidate source: the symmetric tensor of what it answers.
inline constexpr Eigen::Index kPerSource = 6;

using GroupMatrix = Eigen::Matrix<double, kPerSource, kPerSource>;

/// A linear model y = A u + nuisance + noise of unit variance whose unknowns come in groups of kPerSource, as its
/// normal equations. Of A^T A, most of which no choice of groups looks at, rows are made when they are asked for.
class GroupedSystem {
 public:
  /// @param design A, which must outlive this
  /// @param nuisance orthonormal columns whose amounts are unknown: projected out of A and y
  /// @param unit_m amplitudes of this size are large; prior variances are looked for below its square
  GroupedSystem(const Eigen::MatrixXd& design, const Eigen::MatrixXd& nuisance, const Eigen::VectorXd& y,
                double unit_m);

  Eigen::Index groups() const { return right_.size() / kPerSource; }
  const Eigen::VectorXd& right() const { return right_; }  ///< A^T y.
  double y_squared() const { return y_squared_; }          ///< y^T y.
  double n_rows() const { return n_rows_; }                ///< Rows less the nuisance unknowns.
  double unit_m() const { return unit_m_; }
  /// Of A^T A, on the diagonal.
  const GroupMatrix& block(Eigen::Index group) const { return blocks_[static_cast<std::size_t>(group)]; }
  Eigen::MatrixXd rows(Eigen::Index first_group, Eigen::Index count) const;  ///< Of A^T A, kPerSource each.

 private:
  const Eigen::MatrixXd& design_;
  Eigen::MatrixXd of_nuisance_;  ///< nuisance^T A.
  std::vector<GroupMatrix> blocks_;
  Eigen::VectorXd right_;
  double y_squared_;
  double n_rows_;
  double unit_m_;
};

/// What decides how many groups enter.
struct GroupSelectionOptions {
  double least_gain = 6.0;  ///< Log evidence a further group must add [nats].
  std::size_t most_groups = 40;
  double noise_factor = 1.0;   ///< Variance of the noise in units of the one stated.
  bool noise_unknown = false;  ///< Found anew after every group, starting from y itself.
  Eigen::Index likely = 0;     ///< First groups that may well be chosen: their products are made at once.
  /// Prior variances of the first groups, where these are chosen beforehand and no other is to enter.
  std::vector<double> chosen_variances;
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
