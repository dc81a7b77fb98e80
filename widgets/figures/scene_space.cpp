#include "widgets/figures/scene_space.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fieldtrue::widgets {
namespace {

constexpr double kSameCoordinate_m = 1e-3;  ///< Coordinates closer than this lie on one grid line.
constexpr std::size_t kMostGridLines = 40;  ///< More distinct coordinates than this are not a grid.
constexpr double kLeastPitch_m = 0.02;

std::vector<double> distinctCoordinates(std::span<const Eigen::Vector3d> points_m, int axis) {
  std::vector<double> values;
  values.reserve(points_m.size());
  for (const Eigen::Vector3d& point : points_m) values.push_back(point[axis]);
  std::sort(values.begin(), values.end());
  std::vector<double> distinct;
  for (const double value : values)
    if (distinct.empty() || value - distinct.back() > kSameCoordinate_m) distinct.push_back(value);
  return distinct;
}

std::optional<double> regularPitch_m(const std::vector<double>& distinct) {
  if (distinct.size() < 2 || distinct.size() > kMostGridLines) return std::nullopt;
  std::vector<double> gaps;
  for (std::size_t k = 1; k < distinct.size(); ++k) gaps.push_back(distinct[k] - distinct[k - 1]);
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
  const double pitch = gaps[gaps.size() / 2];
  return pitch >= kLeastPitch_m ? std::optional(pitch) : std::nullopt;
}

}  // namespace

double roundStep(double least) {
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= least * (1.0 - 1e-12)) return factor * power;
  return 10.0 * power;
}

Eigen::Vector3d gridPitch_m(std::span<const Eigen::Vector3d> points_m) {
  std::array<std::optional<double>, 3> found;
  double extent = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> distinct = distinctCoordinates(points_m, axis);
    found[static_cast<std::size_t>(axis)] = regularPitch_m(distinct);
    if (!distinct.empty()) extent = std::max(extent, distinct.back() - distinct.front());
  }
  double fallback = roundStep(std::max(extent, 8 * kLeastPitch_m) / 8.0);
  for (const auto& pitch : found)
    if (pitch) fallback = *pitch;
  return {found[0].value_or(fallback), found[1].value_or(fallback), found[2].value_or(fallback)};
}

SceneSpace spaceAround(std::span<const Eigen::Vector3d> points_m, const Pose& reference_from_tracker,
                       std::optional<double> floor_m) {
  SceneSpace space;
  space.transmitter_m = reference_from_tracker.position_m;
  if (points_m.empty()) {
    space.low_m += space.transmitter_m;
    space.high_m += space.transmitter_m;
    return space;
  }
  Eigen::Vector3d low = points_m.front(), high = points_m.front();
  for (const Eigen::Vector3d& point : points_m) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  space.grid_origin_m = low;
  space.pitch_m = gridPitch_m(points_m);
  space.mark_radius_m = 0.1 * space.pitch_m.minCoeff();
  const double floor_z_m = floor_m.value_or(low.z() - space.pitch_m.z());
  low = low.cwiseMin(space.transmitter_m) - 0.5 * space.pitch_m;
  high = high.cwiseMax(space.transmitter_m) + 0.5 * space.pitch_m;
  low.z() = std::min(floor_z_m, low.z() + 0.4 * space.pitch_m.z());
  space.low_m = low;
  space.high_m = high;
  return space;
}

}  // namespace fieldtrue::widgets
