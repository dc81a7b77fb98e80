#include "calib/calibration/evaluator.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <utility>

#include "calib/correctors/baked/baked_position.h"
#include "calib/correctors/readers.h"

namespace fieldtrue::calibration {
namespace {

/// A key of the mountings: the sensor's number.
int sensorFrom(const JsonReader& mounts, const std::string& key) {
  int sensor = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), sensor);
  if (error != std::errc() || end != key.data() + key.size())
    mounts.fail("has the key '" + key + "', which is not a sensor's number");
  return sensor;
}

Alignment alignmentFrom(const JsonReader& from) {
  Alignment alignment;
  alignment.reference_from_tracker = from["reference_from_tracker"].pose();
  alignment.sensor_from_mount = from["sensor_from_mount_wxyz"].quaternion();
  if (const auto mounts = from.find("mounts_wxyz"))
    for (const auto& [sensor, raw] : mounts->object().items())
      alignment.mounts[sensorFrom(*mounts, sensor)] = (*mounts)[sensor].quaternion();
  return alignment;
}

/// Poses that are corrected together, in memory of their own on the stack.
constexpr std::size_t kBlock = 256;

/// Of the poses those that are covered.
void correctPoses(const correctors::PositionModel& position, std::span<const Pose> tracked,
                  const std::array<bool, kBlock>& is_covered, std::span<Eigen::Vector3d> p_m) {
  std::array<Pose, kBlock> covered;
  std::size_t n_covered = 0;
  for (std::size_t i = 0; i < tracked.size(); ++i)
    if (is_covered[i]) covered[n_covered++] = tracked[i];
  position.correctPoses(std::span<const Pose>(covered).first(n_covered), p_m);
}

}  // namespace

Evaluator::Evaluator(Parts parts)
    : parts_(std::move(parts)), rotation_(parts_.alignment.reference_from_tracker.orientation.toRotationMatrix()) {
  FT_CHECK(parts_.position && parts_.orientation);
}

Evaluator::Parts evaluatorPartsFrom(const JsonReader& content) {
  const JsonReader position = content["position"], orientation = content["orientation"];
  const auto read_position = position["method"].valueOf(correctors::findPositionReader(position["method"].text()));
  const auto read_orientation =
      orientation["method"].valueOf(correctors::findOrientationReader(orientation["method"].text()));
  Evaluator::Parts parts;
  parts.alignment = alignmentFrom(content["alignment"]);
  parts.is_baked = position.has("baked");
  parts.position = parts.is_baked ? correctors::readBaked(position["baked"]) : read_position(position["parameters"]);
  parts.orientation = read_orientation(orientation["parameters"]);
  parts.region = Region::fromJson(content["region"]);
  return parts;
}

Pose Evaluator::correct(const Pose& tracker_from_sensor, std::optional<int> sensor) const {
  const Eigen::Vector3d& p_tracked_m = tracker_from_sensor.position_m;
  Pose corrected;
  corrected.position_m = p_tracked_m;
  if (parts_.position->covers(p_tracked_m))
    corrected.position_m += parts_.position->displacementAt_m(tracker_from_sensor);
  corrected.position_m = toReference_m(corrected.position_m);
  const Eigen::Quaterniond q_true = parts_.orientation->covers(p_tracked_m)
                                        ? parts_.orientation->correct(p_tracked_m, tracker_from_sensor.orientation)
                                        : tracker_from_sensor.orientation;
  corrected.orientation =
      parts_.alignment.reference_from_tracker.orientation * q_true * parts_.alignment.mountOf(sensor);
  return corrected;
}

void Evaluator::correct(std::span<const Pose> tracker_from_sensor, std::span<Pose> reference_from_sensor,
                        std::span<const std::optional<int>> sensors) const {
  FT_CHECK(tracker_from_sensor.size() == reference_from_sensor.size());
  FT_CHECK(sensors.empty() || sensors.size() == tracker_from_sensor.size());
  for (std::size_t start = 0; start < tracker_from_sensor.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, tracker_from_sensor.size() - start);
    correctBlock(tracker_from_sensor.subspan(start, count), reference_from_sensor.subspan(start, count),
                 sensors.empty() ? sensors : sensors.subspan(start, count));
  }
}

void Evaluator::correctBlock(std::span<const Pose> tracker_from_sensor, std::span<Pose> reference_from_sensor,
                             std::span<const std::optional<int>> sensors) const {
  const correctors::PositionModel& position = *parts_.position;
  std::array<Eigen::Vector3d, kBlock> covered_m;
  std::array<bool, kBlock> is_covered;
  std::size_t n_covered = 0;
  for (std::size_t i = 0; i < tracker_from_sensor.size(); ++i) {
    is_covered[i] = position.covers(tracker_from_sensor[i].position_m);
    if (!is_covered[i]) continue;
    covered_m[n_covered++] = tracker_from_sensor[i].position_m;
  }
  const std::span p_m = std::span(covered_m).first(n_covered);
  if (position.takesOrientation())
    correctPoses(position, tracker_from_sensor, is_covered, p_m);
  else
    position.correct(p_m, p_m);
  std::size_t next = 0;
  for (std::size_t i = 0; i < tracker_from_sensor.size(); ++i) {
    const Pose& tracked = tracker_from_sensor[i];
    const Eigen::Vector3d p_true_m = is_covered[i] ? covered_m[next++] : tracked.position_m;
    const Eigen::Quaterniond q_true = parts_.orientation->covers(tracked.position_m)
                                          ? parts_.orientation->correct(tracked.position_m, tracked.orientation)
                                          : tracked.orientation;
    reference_from_sensor[i].position_m = toReference_m(p_true_m);
    reference_from_sensor[i].orientation = parts_.alignment.reference_from_tracker.orientation * q_true *
                                           parts_.alignment.mountOf(sensors.empty() ? std::nullopt : sensors[i]);
  }
}

void Evaluator::correctPositions(std::span<const Eigen::Vector3d> p_tracked_m,
                                 std::span<Eigen::Vector3d> p_true_m) const {
  FT_CHECK(p_tracked_m.size() == p_true_m.size());
  std::array<Eigen::Vector3d, kBlock> covered_m;
  std::array<std::size_t, kBlock> slots;
  for (std::size_t start = 0; start < p_tracked_m.size(); start += kBlock) {
    const std::size_t end = std::min(start + kBlock, p_tracked_m.size());
    std::size_t n_covered = 0;
    for (std::size_t i = start; i < end; ++i) {
      p_true_m[i] = p_tracked_m[i];
      if (!parts_.position->covers(p_tracked_m[i])) continue;
      covered_m[n_covered] = p_tracked_m[i];
      slots[n_covered++] = i;
    }
    const std::span p_m = std::span(covered_m).first(n_covered);
    parts_.position->correct(p_m, p_m);
    for (std::size_t k = 0; k < n_covered; ++k) p_true_m[slots[k]] = covered_m[k];
    for (std::size_t i = start; i < end; ++i) p_true_m[i] = toReference_m(p_true_m[i]);
  }
}

Eigen::Vector3d Evaluator::correctPosition_m(const Eigen::Vector3d& p_tracked_m) const {
  if (!parts_.position->covers(p_tracked_m)) return toReference_m(p_tracked_m);
  const Eigen::Vector3d p_true_m = p_tracked_m + parts_.position->displacement_m(p_tracked_m);
  return toReference_m(p_true_m);
}

std::optional<double> Evaluator::uncertainty_m(const Eigen::Vector3d& p_tracked_m) const {
  return parts_.position->covers(p_tracked_m) ? parts_.position->uncertainty_m(p_tracked_m) : std::nullopt;
}

std::optional<double> Evaluator::uncertaintyAt_m(const Pose& tracker_from_sensor) const {
  return parts_.position->covers(tracker_from_sensor.position_m) ? parts_.position->uncertaintyAt_m(tracker_from_sensor)
                                                                 : std::nullopt;
}

bool Evaluator::covers(const Eigen::Vector3d& p_tracked_m) const {
  return parts_.region.contains(p_tracked_m) && parts_.position->covers(p_tracked_m);
}

Eigen::Matrix3d Evaluator::jacobian(const Eigen::Vector3d& p_tracked_m) const {
  return parts_.position->covers(p_tracked_m) ? Eigen::Matrix3d(rotation_ * parts_.position->jacobian(p_tracked_m))
                                              : rotation_;
}

}  // namespace fieldtrue::calibration
