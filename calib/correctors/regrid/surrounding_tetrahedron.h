#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "calib/core/pose.h"

namespace fieldtrue::correctors {

/// The tetrahedron of smallest volume, among all that four of the candidates make, that surrounds a point. Flat ones do
/// not count; of equal volumes the one with the nearer corners wins.
/// @param candidates_m corners to choose from, in any frame [m]
/// @param point_m in the same frame; on a face counts as surrounded
/// @return indices of the corners, ascending; none when no tetrahedron surrounds the point
/// @source survey by Kindratenko, section 5, on Briggs 1999
std::optional<std::array<std::size_t, 4>> smallestSurroundingTetrahedron(std::span<const Eigen::Vector3d> candidates_m,
                                                                         const Eigen::Vector3d& point_m);

}  // namespace fieldtrue::correctors
