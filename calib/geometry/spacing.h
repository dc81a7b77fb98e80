#pragma once

#include <Eigen/Core>
#include <span>

namespace fieldtrue {

/// Median distance from a point to its nearest other one [m]; 0 for fewer than two points.
double medianSpacing_m(std::span<const Eigen::Vector3d> points_m);

}  // namespace fieldtrue
