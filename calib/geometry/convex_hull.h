#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace fieldtrue {

/// Corners of the convex hull of points in a plane, counter-clockwise; fewer than 3 when the points lie on one line.
/// @source Andrew 1979, monotone chain
std::vector<Eigen::Vector2d> convexPolygon(std::vector<Eigen::Vector2d> points);

/// Outward unit normals of the facets of the convex hull of points in space.
/// @return none when the points enclose no volume or Qhull fails on them
/// @source Barber, Dobkin, Huhdanpaa 1996, Quickhull
std::optional<std::vector<Eigen::Vector3d>> convexHullNormals(std::span<const Eigen::Vector3d> points_m);

}  // namespace fieldtrue
