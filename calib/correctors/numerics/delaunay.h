#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::correctors {

/// Points joined to Delaunay tetrahedra. Points on a regular grid have no unique answer; one is chosen, and flat
/// tetrahedra may be among it.
/// @source Barber, Dobkin, Huhdanpaa 1996, The Quickhull algorithm for convex hulls
class Delaunay {
 public:
  using Corners = std::array<int, 4>;  ///< Numbers of points, ascending.

  /// @param name stands in messages
  /// @error kTooFewNodes below 4 points; kDegenerate when Qhull finds no volume (four points are one tetrahedron, flat
  /// or not)
  static Result<Delaunay> of(std::span<const Eigen::Vector3d> points_m, const std::string& name);

  /// In a fixed order.
  const std::vector<Corners>& tetrahedra() const { return tetrahedra_; }

  /// The tetrahedra of all points but some, by the numbers of all, in a fixed order: one after the other is taken out,
  /// and the hole that it leaves is filled from the points around it. None where Qhull finds nothing between those.
  /// @source Devillers 1999, On deletion in Delaunay triangulations
  std::optional<std::vector<Corners>> without(std::span<const std::size_t> points) const;

 private:
  Eigen::Vector3d at(int point) const;
  bool takeOut(int point, std::vector<Corners>& cells) const;

  std::vector<double> coordinates_;  ///< x y z of one point after the other, scaled and shaken.
  std::vector<Corners> tetrahedra_;
};

}  // namespace fieldtrue::correctors
