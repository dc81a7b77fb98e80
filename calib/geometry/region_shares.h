#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace fieldtrue {

/// Which share of a region each of its places stands for: the part of their convex hull that is nearest to it. A place
/// at a face of a grid stands for a half, at a corner for an eighth of what one inside does; in a plane the part is of
/// its area, on a line of its length; places that enclose nothing share alike. Estimated at 4,000 points or eight a
/// place; the sum is 1.
std::vector<double> regionShares(std::span<const Eigen::Vector3d> places_m);

}  // namespace fieldtrue
