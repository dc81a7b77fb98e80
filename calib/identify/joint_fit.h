#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calib/identify/refine.h"

namespace fieldtrue::identify {

struct RefineOptions {
  ResidualLaw law;
  std::span<const char> used = {};  ///< Per row; empty = all.
  int most_steps = 30;
  bool bounded_by_places = true;                      ///< Else searched parameters keep to their own bounds only.
  std::optional<Eigen::Index> frozen = std::nullopt;  ///< A parameter that stays as it is, counted as in `covariance`.
};

struct RefinedModel {
  GapModel model;
  Eigen::MatrixXd covariance;  ///< Of [alignment step, then per term linear and searched parameters].
  Eigen::Index n_alignment = 0;
  double cost = 0.0;
};

/// Where the parameters of a term begin in a refined model's covariance.
Eigen::Index firstParameterOf(const RefinedModel& refined, std::size_t term);

/// Fits all parameters of a model together against the tracker's own nonlinear solution, by Levenberg and Marquardt
/// with weights that follow the residual law.
RefinedModel refineJointly(const GapPhysics& physics, const GapModel& start, const Whitening& whitening,
                           const RefineOptions& options);
/// The two halves of it: covariance and cost of a model that is fitted already cost as much as a step of the fit.
GapModel fitJointly(const GapPhysics& physics, const GapModel& start, const Whitening& whitening,
                    const RefineOptions& options);
RefinedModel withCovariance(const GapPhysics& physics, const GapModel& fitted, const Whitening& whitening,
                            const RefineOptions& options);

}  // namespace fieldtrue::identify
