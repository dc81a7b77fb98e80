#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "calib/geometry/geometry.h"

namespace fieldtrue::evaluation {

/// Points spread evenly over the region that places span.
struct RegionLattice {
  std::vector<Eigen::Vector3d> points_m;
  double step_m = 0.0;                                 ///< Longest distance between neighbours along an axis.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Columns: directions of the lattice.
  int dimension = 0;                                   ///< Number of those directions that are used.
};

/// Middles of the cells of a box around the points, those inside the region: along the axes in a volume, along the
/// principal axes in a plane; none below two dimensions.
/// @param dimension of the points, 3 or 2
/// @param region of the points, in their frame
/// @param most upper bound of the number of points
RegionLattice latticeInside(std::span<const Eigen::Vector3d> points_m, int dimension, const Region& region,
                            std::size_t most);

/// Distance to the nearest of the points [m].
double nearestDistance_m(std::span<const Eigen::Vector3d> points_m, const Eigen::Vector3d& from_m);

}  // namespace fieldtrue::evaluation
