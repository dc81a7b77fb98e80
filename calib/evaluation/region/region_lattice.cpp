#include "calib/evaluation/region/region_lattice.h"

#include <algorithm>
#include <cmath>

#include "calib/core/statistics.h"

namespace fieldtrue::evaluation {
namespace {

/// The points' box in the lattice's own directions.
struct LocalBox {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d extent_m = Eigen::Vector3d::Zero();
};

LocalBox boxAround(std::span<const Eigen::Vector3d> points_m, const Eigen::Matrix3d& axes) {
  Eigen::Vector3d low_m = axes.transpose() * points_m.front();
  Eigen::Vector3d high_m = low_m;
  for (const Eigen::Vector3d& point_m : points_m) {
    low_m = low_m.cwiseMin(axes.transpose() * point_m);
    high_m = high_m.cwiseMax(axes.transpose() * point_m);
  }
  return {low_m, high_m - low_m};
}

/// Cells along each axis, near cubes, no more than `most` together.
Eigen::Vector3i cellCounts(const Eigen::Vector3d& extent_m, int dimension, std::size_t most) {
  const double size = extent_m.head(dimension).prod();
  const double edge_m = std::pow(size / static_cast<double>(most), 1.0 / dimension);
  Eigen::Vector3i counts = Eigen::Vector3i::Ones();
  for (int axis = 0; axis < dimension; ++axis)
    counts[axis] = std::max(1, static_cast<int>(std::floor(extent_m[axis] / edge_m)));
  return counts;
}

}  // namespace

RegionLattice latticeInside(std::span<const Eigen::Vector3d> points_m, int dimension, const Region& region,
                            std::size_t most) {
  RegionLattice lattice;
  if (dimension < 2 || region.empty()) return lattice;
  lattice.dimension = dimension;
  if (dimension == 2) lattice.axes = pointSpread(points_m).axes;
  const LocalBox box = boxAround(points_m, lattice.axes);
  const Eigen::Vector3i counts = cellCounts(box.extent_m, dimension, most);
  const Eigen::Vector3d step_m = box.extent_m.cwiseQuotient(counts.cast<double>());
  lattice.step_m = step_m.head(dimension).maxCoeff();
  for (int k = 0; k < counts.z(); ++k)
    for (int j = 0; j < counts.y(); ++j)
      for (int i = 0; i < counts.x(); ++i) {
        const Eigen::Vector3d middle = Eigen::Vector3d(i, j, k) + Eigen::Vector3d::Constant(0.5);
        const Eigen::Vector3d point_m = lattice.axes * (box.low_m + step_m.cwiseProduct(middle));
        if (region.contains(point_m)) lattice.points_m.push_back(point_m);
      }
  return lattice;
}

double nearestDistance_m(std::span<const Eigen::Vector3d> points_m, const Eigen::Vector3d& from_m) {
  double shortest_m2 = HUGE_VAL;
  for (const Eigen::Vector3d& point_m : points_m) shortest_m2 = std::min(shortest_m2, (point_m - from_m).squaredNorm());
  return std::sqrt(shortest_m2);
}

}  // namespace fieldtrue::evaluation
