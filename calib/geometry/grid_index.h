#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/pose.h"

namespace fieldtrue {

/// Grid index i j k of points that stand on a rectilinear grid along the axes, of any spacing, with or without gaps.
/// @param points_m in the frame whose axes the grid follows
/// @return one index a point, or none when an axis has a single level, two different points would share an index, or
///         fewer than half of the grid's places are there: then the points count as scattered
std::optional<std::vector<std::array<int, 3>>> gridIndex(std::span<const Eigen::Vector3d> points_m);

}  // namespace fieldtrue
