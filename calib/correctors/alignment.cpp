#include <algorithm>

#include "calib/core/statistics.h"
#include "calib/correctors/corrector.h"

namespace fieldtrue {
namespace {

/// Positions and orientations of every row must be numbers before anything is fitted to them.
Result<void> checkRows(std::span<const Node> nodes) {
  for (const Node& node : nodes) {
    if (!node.reference_from_sensor.position_m.allFinite() || !node.tracker_from_sensor.position_m.allFinite())
      return fail(ErrorCode::kBadInput, "Place " + std::to_string(node.node) + " (visit " + std::to_string(node.visit) +
                                            ") has a coordinate that is not a finite number");
    const double norm_true = node.reference_from_sensor.orientation.norm();
    const double norm_tracked = node.tracker_from_sensor.orientation.norm();
    if (!(std::abs(norm_true - 1.0) < 1e-3) || !(std::abs(norm_tracked - 1.0) < 1e-3))
      return fail(ErrorCode::kBadInput, "Place " + std::to_string(node.node) + " (visit " + std::to_string(node.visit) +
                                            ") has an orientation that is not a unit quaternion");
  }
  return {};
}

/// The constant rotation between holder and sensor that the tracked orientations show once the frames are aligned.
Eigen::Quaterniond fitMounting(std::span<const Node> nodes, const Eigen::Quaterniond& reference_from_tracker) {
  std::vector<Eigen::Quaterniond> sensor_from_mount;
  for (const Node& node : nodes) {
    if (!node.has_orientation) continue;
    const Eigen::Quaterniond reference_from_sensor = reference_from_tracker * node.tracker_from_sensor.orientation;
    sensor_from_mount.push_back(reference_from_sensor.conjugate() * node.reference_from_sensor.orientation);
  }
  return sensor_from_mount.empty() ? Eigen::Quaterniond::Identity() : canonical(meanRotation(sensor_from_mount));
}

}  // namespace

AlignMode defaultAlignMode(const TableMetadata& metadata) {
  return metadata.alignment_known ? AlignMode::kNone : AlignMode::kRigid;
}

Result<Alignment> fitAlignment(std::span<const Node> nodes) {
  if (auto checked = checkRows(nodes); !checked) return tl::unexpected(checked.error());
  std::vector<Eigen::Vector3d> p_tracked_m;
  std::vector<Eigen::Vector3d> p_true_m;
  for (const Node& node : nodes) {
    p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    p_true_m.push_back(node.reference_from_sensor.position_m);
  }
  const auto reference_from_tracker = fitRigid(p_tracked_m, p_true_m);
  if (!reference_from_tracker)
    return fail(reference_from_tracker.error().code,
                "The alignment of rig and tracker cannot be found: " + reference_from_tracker.error().message);
  return Alignment{*reference_from_tracker, fitMounting(nodes, reference_from_tracker->orientation)};
}

FitData makeFitData(std::span<const Node> nodes, const Alignment& alignment) {
  FitData data;
  const Pose tracker_from_reference = inverse(alignment.reference_from_tracker);
  const Eigen::Quaterniond mount_from_sensor = alignment.sensor_from_mount.conjugate();
  const bool has_orientation =
      !nodes.empty() && std::all_of(nodes.begin(), nodes.end(), [](const Node& node) { return node.has_orientation; });
  for (const Node& node : nodes) {
    data.p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    data.p_true_m.push_back(tracker_from_reference * node.reference_from_sensor.position_m);
    data.node.push_back(node.node);
    if (!has_orientation) continue;
    data.q_tracked.push_back(node.tracker_from_sensor.orientation);
    data.q_true.push_back(tracker_from_reference.orientation * node.reference_from_sensor.orientation *
                          mount_from_sensor);
  }
  data.dimension = pointSpread(data.p_true_m).dimension;
  return data;
}

}  // namespace fieldtrue
