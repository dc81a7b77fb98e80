#pragma once

#include <Eigen/Core>
#include <span>

namespace fieldtrue::correctors {

/// Where a method is asked for positions beyond those it was fitted to: inside a box at the position itself; beyond a
/// face by x along an axis at reach tanh(x / reach) beyond it. That has two continuous derivatives and never goes
/// farther than the reach, so a correction taken there has no kink and is level far out.
struct SoftBox {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
  double reach_m = 0.0;

  /// The box of one position or more.
  /// @param reach share of its longest side
  static SoftBox around(std::span<const Eigen::Vector3d> p_m, double reach);

  double distance_m(const Eigen::Vector3d& p_m) const {
    return (low_m - p_m).cwiseMax(p_m - high_m).cwiseMax(0.0).norm();
  }
  double longest_m() const { return (high_m - low_m).maxCoeff(); }
  Eigen::Vector3d held_m(const Eigen::Vector3d& p_m) const;
  /// d held / d p along each axis: 1 inside, 1 - tanh(x / reach)^2 beyond.
  Eigen::Vector3d slope(const Eigen::Vector3d& p_m) const;
};

}  // namespace fieldtrue::correctors
