#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace fieldtrue {

/// Median distance from a point to its nearest other one [m]; 0 for fewer than two points.
double medianSpacing_m(std::span<const Eigen::Vector3d> points_m);

/// A subset of places that spans them all and still holds near pairs: half by farthest-point choice, half their nearest
/// neighbours; ascending. All of them when there are no more than `count`.
std::vector<std::size_t> spreadPlaces(std::span<const Eigen::Vector3d> p_m, std::size_t count);

}  // namespace fieldtrue
