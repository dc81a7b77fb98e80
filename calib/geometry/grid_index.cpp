#include "calib/geometry/grid_index.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace fieldtrue {
namespace {

/// Coordinates closer than this are one level: ten times the tolerance of a careful jig, far below any pitch used.
constexpr double kSameLevel_m = 0.02;

/// Level of each coordinate, counted upwards; a level ends where the next coordinate is farther than the tolerance.
std::vector<int> levelsOf(std::span<const Eigen::Vector3d> points_m, int axis, int& n_levels) {
  std::vector<std::size_t> order(points_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return points_m[a][axis] < points_m[b][axis]; });
  std::vector<int> levels(points_m.size(), 0);
  int level = 0;
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (points_m[order[i]][axis] - points_m[order[i - 1]][axis] > kSameLevel_m) ++level;
    levels[order[i]] = level;
  }
  n_levels = level + 1;
  return levels;
}

}  // namespace

std::optional<std::vector<std::array<int, 3>>> gridIndex(std::span<const Eigen::Vector3d> points_m) {
  if (points_m.empty()) return std::nullopt;
  std::vector<std::array<int, 3>> index(points_m.size());
  std::size_t n_cells = 1;
  for (int axis = 0; axis < 3; ++axis) {
    int n_levels = 0;
    const std::vector<int> levels = levelsOf(points_m, axis, n_levels);
    if (n_levels < 2) return std::nullopt;
    for (std::size_t i = 0; i < levels.size(); ++i) index[i][static_cast<std::size_t>(axis)] = levels[i];
    n_cells *= static_cast<std::size_t>(n_levels);
  }
  std::map<std::array<int, 3>, std::size_t> first;
  for (std::size_t i = 0; i < index.size(); ++i) {
    const auto [at, is_new] = first.emplace(index[i], i);
    if (!is_new && (points_m[at->second] - points_m[i]).norm() > kSameLevel_m) return std::nullopt;
  }
  if (2 * first.size() < n_cells) return std::nullopt;
  return index;
}

}  // namespace fieldtrue
