#include "calib/recording/recording_change.h"

#include <cmath>
#include <map>
#include <numbers>

#include "calib/core/statistics.h"

namespace fieldtrue::recording {
namespace {

struct Reported {
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  std::vector<Eigen::Quaterniond> orientations;
  std::size_t visits = 0;
  bool has_orientation = true;

  Pose mean() const {
    Pose pose;
    pose.position_m = sum_m / static_cast<double>(visits);
    if (has_orientation) pose.orientation = meanRotation(orientations);
    return pose;
  }
};

std::map<int, Reported> reportedBy(const CalibrationTable& table) {
  std::map<int, Reported> reported;
  for (const Node& node : table.nodes) {
    if (node.role == NodeRole::kSkipped) continue;
    Reported& place = reported[node.node];
    place.sum_m += node.tracker_from_sensor.position_m;
    place.orientations.push_back(node.tracker_from_sensor.orientation);
    place.has_orientation = place.has_orientation && node.has_orientation;
    ++place.visits;
  }
  return reported;
}

}  // namespace

Result<CalibrationTable> changeSince(const CalibrationTable& before, const CalibrationTable& now) {
  const std::map<int, Reported> reported = reportedBy(before);
  CalibrationTable change;
  change.metadata = now.metadata;
  change.metadata.alignment_known = false;
  for (auto* tolerance : {&change.metadata.jig_tolerance_m, &change.metadata.jig_tolerance_rad})
    if (*tolerance) **tolerance *= std::numbers::sqrt2;
  for (Node node : now.nodes) {
    const auto found = reported.find(node.node);
    if (found == reported.end()) continue;
    node.reference_from_sensor = found->second.mean();
    node.has_orientation = node.has_orientation && found->second.has_orientation;
    change.nodes.push_back(node);
  }
  if (change.nodes.empty())
    return fail(ErrorCode::kTooFewNodes,
                "No node of the earlier recording is in this one; both must number their places alike.");
  return change;
}

}  // namespace fieldtrue::recording
