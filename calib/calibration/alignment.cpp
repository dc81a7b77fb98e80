#include "calib/calibration/alignment.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "calib/calibration/outlying_places.h"
#include "calib/core/place_name.h"
#include "calib/core/statistics.h"
#include "calib/geometry/grid_index.h"

namespace fieldtrue::calibration {
namespace {

/// Positions and orientations of every row must be numbers before anything is fitted to them.
Result<void> checkRows(std::span<const Node> nodes) {
  for (const Node& node : nodes) {
    if (!node.reference_from_sensor.position_m.allFinite() || !node.tracker_from_sensor.position_m.allFinite())
      return fail(ErrorCode::kBadInput, placeName(node.node, node.index) + " (visit " + std::to_string(node.visit) +
                                            ") has a coordinate that is not a finite number");
    const double norm_true = node.reference_from_sensor.orientation.norm();
    const double norm_tracked = node.tracker_from_sensor.orientation.norm();
    if (!(std::abs(norm_true - 1.0) < 1e-3) || !(std::abs(norm_tracked - 1.0) < 1e-3))
      return fail(ErrorCode::kBadInput, placeName(node.node, node.index) + " (visit " + std::to_string(node.visit) +
                                            ") has an orientation that is not a unit quaternion");
  }
  return {};
}

/// Truth and reading of one row's orientation, both in the tracker frame.
struct OrientationPair {
  Eigen::Quaterniond tracker_from_mount;   ///< What the rig says.
  Eigen::Quaterniond tracker_from_sensor;  ///< What the tracker said.
};

/// One step towards the mounting while the tracker's own mean rotation error is free too: turned in its holder to
/// several orientations, a sensor tells the two apart, and a mean error must not pass for mounting. Where the
/// orientations do not tell them apart (all alike, or all turned about one axis), what cannot be told counts as
/// mounting.
/// @param q_error mean error rotation, tracker frame; improved
/// @param sensor_from_mount improved
void improveMounting(const std::vector<OrientationPair>& pairs, Eigen::Quaterniond& q_error,
                     Eigen::Quaterniond& sensor_from_mount) {
  // Residual r_i = A_i e + m to first order, e the change of the error (tracker frame), m that of the mounting (its
  // frame).
  constexpr double kToldApart = 0.01;  // sin^2 of 6 degrees between orientations.
  Eigen::Matrix3d mean_a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_r = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_a_r = Eigen::Vector3d::Zero();
  const double weight = 1.0 / static_cast<double>(pairs.size());
  for (const OrientationPair& pair : pairs) {
    const Eigen::Quaterniond predicted = q_error * pair.tracker_from_sensor * sensor_from_mount;
    const Eigen::Matrix3d A = predicted.conjugate().toRotationMatrix();
    const Eigen::Vector3d r = rotationVector_rad(predicted.conjugate() * pair.tracker_from_mount);
    mean_a += weight * A;
    mean_r += weight * r;
    mean_a_r += weight * (A.transpose() * r);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> reduced(Eigen::Matrix3d::Identity() -
                                                               mean_a.transpose() * mean_a);
  const Eigen::Vector3d right_side = mean_a_r - mean_a.transpose() * mean_r;
  Eigen::Vector3d e = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k)
    if (reduced.eigenvalues()[k] > kToldApart)
      e += reduced.eigenvectors().col(k) * (reduced.eigenvectors().col(k).dot(right_side) / reduced.eigenvalues()[k]);
  q_error = (rotationFromVector(e) * q_error).normalized();
  sensor_from_mount = (sensor_from_mount * rotationFromVector(mean_r - mean_a * e)).normalized();
}

/// The rows of each sensor.
std::map<int, std::vector<Node>> bySensor(std::span<const Node> nodes) {
  std::map<int, std::vector<Node>> rows;
  for (const Node& node : nodes) rows[node.sensor].push_back(node);
  return rows;
}

/// The constant rotation between holder and sensor that the orientations show once the frames are aligned.
Eigen::Quaterniond fitMounting(std::span<const Node> nodes, const Eigen::Quaterniond& reference_from_tracker) {
  std::vector<OrientationPair> pairs;
  std::vector<Eigen::Quaterniond> sensor_from_mount;
  for (const Node& node : nodes) {
    if (!node.has_orientation) continue;
    pairs.push_back({reference_from_tracker.conjugate() * node.reference_from_sensor.orientation,
                     node.tracker_from_sensor.orientation});
    sensor_from_mount.push_back(pairs.back().tracker_from_sensor.conjugate() * pairs.back().tracker_from_mount);
  }
  if (pairs.empty()) return Eigen::Quaterniond::Identity();
  constexpr int kSteps = 6;  // Quadratic convergence from the mean; the third step already moves less than 1e-9 rad.
  Eigen::Quaterniond mounting = meanRotation(sensor_from_mount);
  Eigen::Quaterniond q_error = Eigen::Quaterniond::Identity();
  for (int step = 0; step < kSteps; ++step) improveMounting(pairs, q_error, mounting);
  return canonical(mounting);
}

constexpr double kSideBySide_m = 0.005;

/// Sensors that ride side by side stand at several positions of one index, which tells none of them apart.
bool isIndexShared(std::span<const Node> nodes) {
  std::map<std::array<int, 3>, const Node*> first_there;
  return std::any_of(nodes.begin(), nodes.end(), [&](const Node& node) {
    if (!node.index) return false;
    const Node& first = *first_there.emplace(*node.index, &node).first->second;
    const Eigen::Vector3d apart_m = node.reference_from_sensor.position_m - first.reference_from_sensor.position_m;
    return first.sensor != node.sensor && apart_m.norm() > kSideBySide_m;
  });
}

/// The table's own grid index, or the one its true positions show; empty when they are scattered.
std::vector<std::array<int, 3>> indexOf(std::span<const Node> nodes) {
  std::vector<std::array<int, 3>> index;
  std::vector<Eigen::Vector3d> p_true_m;
  for (const Node& node : nodes) {
    if (node.index) index.push_back(*node.index);
    p_true_m.push_back(node.reference_from_sensor.position_m);
  }
  return index.size() == nodes.size() && !isIndexShared(nodes)
             ? index
             : gridIndex(p_true_m).value_or(std::vector<std::array<int, 3>>());
}

}  // namespace

const Eigen::Quaterniond& Alignment::mountOf(std::optional<int> sensor) const {
  const auto found = sensor ? mounts.find(*sensor) : mounts.end();
  return found == mounts.end() ? sensor_from_mount : found->second;
}

AlignMode defaultAlignMode(const TableMetadata& metadata) {
  return metadata.alignment_known ? AlignMode::kNone : AlignMode::kRigid;
}

Result<Alignment> fitAlignment(std::span<const Node> nodes, std::optional<double> jig_tolerance_m) {
  constexpr int kRounds = 4;
  const auto areAlike = [](double one, double other) { return std::abs(one - other) < 0.01; };
  FT_TRY_VOID(checkRows(nodes));
  std::vector<Eigen::Vector3d> p_tracked_m;
  std::vector<Eigen::Vector3d> p_true_m;
  for (const Node& node : nodes) {
    p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    p_true_m.push_back(node.reference_from_sensor.position_m);
  }
  auto reference_from_tracker = fitRigid(p_tracked_m, p_true_m);
  // A place that lies a long way off hides those that lie a short one.
  std::vector<double> before;
  for (int round = 0; reference_from_tracker && round < kRounds; ++round) {
    std::vector<double> weights = alignmentWeights(nodes, *reference_from_tracker, jig_tolerance_m);
    if (std::ranges::equal(weights, before, areAlike)) break;
    reference_from_tracker = fitRigid(p_tracked_m, p_true_m, weights);
    before = std::move(weights);
  }
  if (!reference_from_tracker)
    return fail(reference_from_tracker.error().code,
                "The alignment of rig and tracker cannot be found: " + reference_from_tracker.error().message);
  Alignment alignment{*reference_from_tracker, {}, {}};
  const std::map<int, std::vector<Node>> rows = bySensor(nodes);
  for (const auto& [sensor, of_sensor] : rows)
    alignment.mounts[sensor] = fitMounting(of_sensor, reference_from_tracker->orientation);
  alignment.sensor_from_mount = alignment.mounts.begin()->second;
  if (alignment.mounts.size() == 1) alignment.mounts.clear();
  return alignment;
}

correctors::FitData makeFitData(std::span<const Node> nodes, const TableMetadata& metadata,
                                const Alignment& alignment) {
  correctors::FitData data;
  const Pose tracker_from_reference = inverse(alignment.reference_from_tracker);
  const auto all_have = [&](const auto& has) { return !nodes.empty() && std::all_of(nodes.begin(), nodes.end(), has); };
  const bool has_orientation = all_have([](const Node& node) { return node.has_orientation; });
  const bool has_noise = all_have([](const Node& node) { return node.covariance_m2.has_value(); });
  for (const Node& node : nodes) {
    data.p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    data.p_true_m.push_back(tracker_from_reference * node.reference_from_sensor.position_m);
    data.node.push_back(node.node);
    if (has_noise) data.noise_m2.push_back(*node.covariance_m2 / std::max(1.0, node.n_effective));
    if (!has_orientation) continue;
    data.q_tracked.push_back(node.tracker_from_sensor.orientation);
    data.q_true.push_back(tracker_from_reference.orientation * node.reference_from_sensor.orientation *
                          alignment.mountOf(node.sensor).conjugate());
  }
  data.index = indexOf(nodes);
  data.jig_sd_m = metadata.jig_tolerance_m.value_or(0.0);
  data.is_dipole = metadata.transmitter_model.value_or("dipole") == "dipole";
  data.dimension = pointSpread(data.p_true_m).dimension;
  return data;
}

}  // namespace fieldtrue::calibration
