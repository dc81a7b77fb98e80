#include "calib/exporters/lattice_field.h"

#include <cmath>

namespace fieldtrue::exporters {

std::size_t LatticePoints::size() const {
  return static_cast<std::size_t>(counts[0]) * static_cast<std::size_t>(counts[1]) *
         static_cast<std::size_t>(counts[2]);
}

std::size_t LatticePoints::at(int i, int j, int k) const {
  return static_cast<std::size_t>(i) +
         static_cast<std::size_t>(counts[0]) *
             (static_cast<std::size_t>(j) + static_cast<std::size_t>(counts[1]) * static_cast<std::size_t>(k));
}

Eigen::Vector3d LatticePoints::point_m(int i, int j, int k) const {
  return origin_m + axes * pitch_m.cwiseProduct(Eigen::Vector3d(i, j, k));
}

Eigen::Vector3d LatticePoints::point_m(std::size_t index) const {
  const auto n0 = static_cast<std::size_t>(counts[0]), n1 = static_cast<std::size_t>(counts[1]);
  return point_m(static_cast<int>(index % n0), static_cast<int>(index / n0 % n1), static_cast<int>(index / (n0 * n1)));
}

Eigen::Vector3d LatticePoints::steps(const Eigen::Vector3d& p_m) const {
  return (axes.transpose() * (p_m - origin_m)).cwiseQuotient(pitch_m);
}

std::optional<Eigen::Vector3d> LatticeField::mapped_m(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d steps = points.steps(p_m);
  std::array<int, 3> cell{};
  Eigen::Vector3d fraction;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = points.counts[static_cast<std::size_t>(axis)];
    if (!(steps[axis] >= -1e-9 && steps[axis] <= n - 1 + 1e-9)) return std::nullopt;
    cell[static_cast<std::size_t>(axis)] = std::clamp(static_cast<int>(std::floor(steps[axis])), 0, std::max(n - 2, 0));
    fraction[axis] = steps[axis] - cell[static_cast<std::size_t>(axis)];
  }
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<int, 3> at = cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool far = ((corner >> axis) & 1) != 0;
      const double along = fraction[static_cast<Eigen::Index>(axis)];
      weight *= far ? along : 1.0 - along;
      if (far) at[axis] = std::min(at[axis] + 1, points.counts[axis] - 1);
    }
    if (weight != 0.0) sum_m += weight * displacement_m[points.at(at[0], at[1], at[2])];
  }
  return p_m + sum_m;
}

}  // namespace fieldtrue::exporters
