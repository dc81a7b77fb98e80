#include "acquisition/sampling/reference_guess.h"

#include <algorithm>

#include "calib/geometry/geometry.h"

namespace fieldtrue::acquisition {

namespace {

constexpr double kSamePosition_m = 1e-3;
constexpr double kOnlyPlaceSpacing_m = 0.3;
constexpr double kFlatReferenceRatio = 0.1;
constexpr std::size_t kNearestPlaces = 4;

}  // namespace

ReferenceGuess guessReference(std::span<const Node> done, const Pose& fallback, bool alignment_known) {
  if (alignment_known) return {fallback, true};
  std::vector<Eigen::Vector3d> tracked_m, true_m;
  for (const Node& node : done) {
    if (node.role == NodeRole::kSkipped) continue;
    tracked_m.push_back(node.tracker_from_sensor.position_m);
    true_m.push_back(node.reference_from_sensor.position_m);
  }
  const int dimension = true_m.size() < 3 ? 0 : pointSpread(true_m, kFlatReferenceRatio).dimension;
  if (dimension < 2) return {fallback, false};
  const Result<Pose> fitted = fitRigid(tracked_m, true_m);
  if (!fitted) return {fallback, false};
  return {*fitted, dimension == 3 && true_m.size() >= 4};
}

double nearDistance_m(const PlannedPlace& place, double spacing, std::span<const Node> done,
                      const Pose& reference_from_tracker) {
  struct Neighbour {
    double distance_m;
    double residual_m;
  };
  std::vector<Neighbour> neighbours;
  for (const Node& node : done) {
    if (node.role == NodeRole::kSkipped) continue;
    const Eigen::Vector3d& true_m = node.reference_from_sensor.position_m;
    neighbours.push_back({(true_m - place.reference_from_sensor.position_m).norm(),
                          (reference_from_tracker * node.tracker_from_sensor.position_m - true_m).norm()});
  }
  const std::size_t nearest = std::min(kNearestPlaces, neighbours.size());
  std::partial_sort(neighbours.begin(), neighbours.begin() + static_cast<std::ptrdiff_t>(nearest), neighbours.end(),
                    [](const Neighbour& a, const Neighbour& b) { return a.distance_m < b.distance_m; });
  double residual_m = 0.0;
  for (std::size_t i = 0; i < nearest; ++i) residual_m = std::max(residual_m, neighbours[i].residual_m);
  return std::min(0.5 * spacing + residual_m, spacing);
}

double spacing_m(std::span<const PlannedPlace> places, std::size_t place) {
  double nearest_m = -1.0;
  for (const PlannedPlace& other : places) {
    const double distance_m =
        (other.reference_from_sensor.position_m - places[place].reference_from_sensor.position_m).norm();
    if (distance_m > kSamePosition_m && (nearest_m < 0.0 || distance_m < nearest_m)) nearest_m = distance_m;
  }
  return nearest_m < 0.0 ? kOnlyPlaceSpacing_m : nearest_m;
}

}  // namespace fieldtrue::acquisition
