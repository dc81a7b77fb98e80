#include "calib/calibration/placed_sensors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/core/file_io.h"

namespace fieldtrue::calibration {
namespace {

constexpr double kOnePoint_m = 1e-9;
constexpr double kSettled_m = 1e-9;
constexpr int kMostRounds = 1000;

/// Whether two sensors of one visit are said to stand at one point.
bool shareOnePoint(std::span<const Node> nodes) {
  std::map<std::pair<int, int>, const Node*> first_of_visit;
  return std::any_of(nodes.begin(), nodes.end(), [&](const Node& node) {
    const Node& first = *first_of_visit.emplace(std::pair(node.node, node.visit), &node).first->second;
    const Eigen::Vector3d apart_m = node.reference_from_sensor.position_m - first.reference_from_sensor.position_m;
    return first.sensor != node.sensor && apart_m.norm() < kOnePoint_m;
  });
}

int lowestSensor(std::span<const Node> nodes) {
  return std::min_element(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) { return a.sensor < b.sensor; })
      ->sensor;
}

/// Of some rows, where each sensor stands as the offsets have it.
Result<Pose> referenceFromTracker(std::span<const Node> nodes, const std::map<int, Eigen::Vector3d>& offsets_m) {
  std::vector<Eigen::Vector3d> p_tracked_m, p_true_m;
  for (const Node& node : nodes) {
    const auto offset_m = offsets_m.find(node.sensor);
    if (offset_m == offsets_m.end()) continue;
    p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    p_true_m.push_back(node.reference_from_sensor * offset_m->second);
  }
  return fitRigid(p_tracked_m, p_true_m);
}

/// Mean of where each sensor is seen from the jig, but for the first one's.
std::map<int, Eigen::Vector3d> seenOffsets_m(std::span<const Node> nodes, const Pose& reference_from_tracker,
                                             int first) {
  std::map<int, Eigen::Vector3d> sums_m;
  std::map<int, double> counts;
  for (const Node& node : nodes) {
    const Eigen::Vector3d seen_m =
        inverse(node.reference_from_sensor) * (reference_from_tracker * node.tracker_from_sensor.position_m);
    sums_m.emplace(node.sensor, Eigen::Vector3d::Zero()).first->second += seen_m;
    counts[node.sensor] += 1.0;
  }
  for (auto& [sensor, sum_m] : sums_m) sum_m /= counts[sensor];
  sums_m[first].setZero();
  return sums_m;
}

/// One unknown after the other until neither moves: the first sensor's rows tell the alignment to begin with.
Result<std::map<int, Eigen::Vector3d>> offsetsOf(std::span<const Node> nodes, AlignMode align) {
  const int first = lowestSensor(nodes);
  if (align == AlignMode::kNone) return seenOffsets_m(nodes, Pose{}, first);
  FT_TRY(auto reference_from_tracker, referenceFromTracker(nodes, {{first, Eigen::Vector3d::Zero()}}));
  std::map<int, Eigen::Vector3d> offsets_m = seenOffsets_m(nodes, reference_from_tracker, first);
  for (int round = 0; round < kMostRounds; ++round) {
    FT_TRY(const auto next, referenceFromTracker(nodes, offsets_m));
    const auto seen_m = seenOffsets_m(nodes, next, first);
    double moved_m = 0.0;
    for (const auto& [sensor, offset_m] : seen_m) moved_m = std::max(moved_m, (offset_m - offsets_m[sensor]).norm());
    offsets_m = seen_m;
    if (moved_m < kSettled_m) break;
  }
  return offsets_m;
}

}  // namespace

std::string PlacedSensors::note() const {
  if (offsets_m.empty()) return "";
  std::string text;
  for (const auto& [sensor, offset_m] : offsets_m) {
    if (sensor == offsets_m.begin()->first) continue;
    text += (text.empty() ? "" : ", ") + ("sensor " + std::to_string(sensor) + " ") +
            formatNumber(std::round(1e4 * offset_m.norm()) / 10.0) + " mm";
  }
  return "The sensors were recorded at one pose; where they sit on the jig was found from all places: " + text +
         " from sensor " + std::to_string(offsets_m.begin()->first) + ".";
}

PlacedSensors placedSensors(std::span<const Node> nodes, AlignMode align) {
  PlacedSensors placed{{nodes.begin(), nodes.end()}, {}};
  if (!shareOnePoint(nodes)) return placed;
  const auto offsets_m = offsetsOf(nodes, align);
  const auto is_finite = [](const auto& offset_m) { return offset_m.second.allFinite(); };
  if (!offsets_m || !std::all_of(offsets_m->begin(), offsets_m->end(), is_finite)) return placed;
  placed.offsets_m = *offsets_m;
  for (Node& node : placed.nodes)
    node.reference_from_sensor.position_m = node.reference_from_sensor * placed.offsets_m.at(node.sensor);
  return placed;
}

}  // namespace fieldtrue::calibration
