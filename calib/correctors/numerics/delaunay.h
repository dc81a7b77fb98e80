#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::correctors {

/// The Delaunay tetrahedra of points, as numbers of their corners, in a fixed order. Points on a regular grid have no
/// unique answer; one is chosen, and flat tetrahedra may be among it.
/// @param name stands in messages
/// @error kDegenerate when the points enclose no volume
/// @source Barber, Dobkin, Huhdanpaa 1996, The Quickhull algorithm for convex hulls
Result<std::vector<std::array<int, 4>>> delaunayTetrahedra(std::span<const Eigen::Vector3d> points_m,
                                                           const std::string& name);

}  // namespace fieldtrue::correctors
