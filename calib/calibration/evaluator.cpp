#include "calib/calibration/evaluator.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <utility>

#include "calib/correctors/baked/baked_position.h"
#include "calib/correctors/readers.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::calibration {
namespace {

/// A key of what is told by sensor: the sensor's number.
int sensorFrom(const JsonReader& by_sensor, const std::string& key) {
  int sensor = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), sensor);
  if (error != std::errc() || end != key.data() + key.size())
    by_sensor.fail("has the key '" + key + "', which is not a sensor's number");
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

bool takesPose(const Evaluator::Parts& parts) {
  return parts.position->takesOrientation() ||
         std::any_of(parts.by_sensor.begin(), parts.by_sensor.end(),
                     [](const auto& one) { return one.second.position->takesOrientation(); });
}

/// The first files did not state it.
void checkInputs(const JsonReader& content, const Evaluator::Parts& parts) {
  const auto inputs = content.find("inputs");
  if (!inputs) return;
  const std::string needed = takesPose(parts) ? "pose" : "position";
  if (inputs->oneOf({"position", "pose"}) != needed)
    inputs->refuse("\"" + needed + "\", which its position part takes");
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
  const JsonReader position_method = content["position"]["method"], turn_method = content["orientation"]["method"];
  const auto read_position = position_method.valueOf(correctors::findPositionReader(position_method.text()));
  const auto read_orientation = turn_method.valueOf(correctors::findOrientationReader(turn_method.text()));
  const auto correction_from = [&](const JsonReader& from) {
    const JsonReader position = from["position"];
    Correction correction;
    correction.is_baked = position.has("baked");
    correction.position =
        correction.is_baked ? correctors::readBaked(position["baked"]) : read_position(position["parameters"]);
    correction.orientation = read_orientation(from["orientation"]["parameters"]);
    correction.region = Region::fromJson(from["region"]);
    return correction;
  };
  Evaluator::Parts parts;
  if (const auto by_sensor = content.find("by_sensor")) {
    for (const auto& [sensor, raw] : by_sensor->object().items())
      parts.by_sensor[sensorFrom(*by_sensor, sensor)] = correction_from((*by_sensor)[sensor]);
    if (parts.by_sensor.empty()) by_sensor->fail("names no sensor");
    static_cast<Correction&>(parts) = parts.by_sensor.begin()->second;
  } else {
    static_cast<Correction&>(parts) = correction_from(content);
  }
  parts.alignment = alignmentFrom(content["alignment"]);
  checkInputs(content, parts);
  return parts;
}

const Correction& Evaluator::of(std::optional<int> sensor) const {
  const auto found = sensor ? parts_.by_sensor.find(*sensor) : parts_.by_sensor.end();
  return found == parts_.by_sensor.end() ? parts_ : found->second;
}

std::vector<int> Evaluator::sensorsApart() const {
  std::vector<int> sensors;
  for (const auto& [sensor, correction] : parts_.by_sensor) sensors.push_back(sensor);
  return sensors;
}

Result<Evaluator::Parts> Evaluator::partsOf(int sensor) const {
  std::vector<int> known = sensorsApart();
  if (known.empty())
    for (const auto& [mounted, mount] : parts_.alignment.mounts) known.push_back(mounted);
  if (!known.empty() && std::find(known.begin(), known.end(), sensor) == known.end())
    return fail(ErrorCode::kBadInput, "This calibration was fitted on " + sensorsText(known) +
                                          ", and knows nothing of sensor " + std::to_string(sensor));
  Parts alone;
  static_cast<Correction&>(alone) = of(sensor);
  alone.alignment = parts_.alignment;
  alone.alignment.sensor_from_mount = parts_.alignment.mountOf(sensor);
  // What the others share may be applied to their readings too; what is this one's may not.
  if (!parts_.by_sensor.empty()) alone.alignment.mounts.clear();
  return alone;
}

bool Evaluator::takesOrientation() const { return takesPose(parts_); }

bool Evaluator::turnTakesOrientation() const {
  return parts_.orientation->takesOrientation() ||
         std::any_of(parts_.by_sensor.begin(), parts_.by_sensor.end(),
                     [](const auto& one) { return one.second.orientation->takesOrientation(); });
}

Pose Evaluator::correct(const Pose& tracker_from_sensor, std::optional<int> sensor) const {
  const Correction& correction = of(sensor);
  const Eigen::Vector3d& p_tracked_m = tracker_from_sensor.position_m;
  Pose corrected;
  corrected.position_m = p_tracked_m;
  if (correction.position->covers(p_tracked_m))
    corrected.position_m += correction.position->displacementAt_m(tracker_from_sensor);
  corrected.position_m = toReference_m(corrected.position_m);
  const Eigen::Quaterniond q_true = correction.orientation->covers(p_tracked_m)
                                        ? correction.orientation->correct(p_tracked_m, tracker_from_sensor.orientation)
                                        : tracker_from_sensor.orientation;
  corrected.orientation =
      parts_.alignment.reference_from_tracker.orientation * q_true * parts_.alignment.mountOf(sensor);
  return corrected;
}

void Evaluator::correct(std::span<const Pose> tracker_from_sensor, std::span<Pose> reference_from_sensor,
                        std::span<const std::optional<int>> sensors) const {
  FT_CHECK(tracker_from_sensor.size() == reference_from_sensor.size());
  FT_CHECK(sensors.empty() || sensors.size() == tracker_from_sensor.size());
  const auto sensorAt = [&](std::size_t i) { return sensors.empty() ? std::nullopt : sensors[i]; };
  for (std::size_t start = 0, count = 0; start < tracker_from_sensor.size(); start += count) {
    const std::size_t most = std::min(kBlock, tracker_from_sensor.size() - start);
    const Correction& correction = of(sensorAt(start));
    count = 1;
    while (count < most && &of(sensorAt(start + count)) == &correction) ++count;
    correctBlock(correction, tracker_from_sensor.subspan(start, count), reference_from_sensor.subspan(start, count),
                 sensors.empty() ? sensors : sensors.subspan(start, count));
  }
}

void Evaluator::correctBlock(const Correction& correction, std::span<const Pose> tracker_from_sensor,
                             std::span<Pose> reference_from_sensor, std::span<const std::optional<int>> sensors) const {
  const correctors::PositionModel& position = *correction.position;
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
    const Eigen::Quaterniond q_true = correction.orientation->covers(tracked.position_m)
                                          ? correction.orientation->correct(tracked.position_m, tracked.orientation)
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

Eigen::Vector3d Evaluator::correctPosition_m(const Eigen::Vector3d& p_tracked_m, std::optional<int> sensor) const {
  const correctors::PositionModel& position = *of(sensor).position;
  if (!position.covers(p_tracked_m)) return toReference_m(p_tracked_m);
  const Eigen::Vector3d p_true_m = p_tracked_m + position.displacement_m(p_tracked_m);
  return toReference_m(p_true_m);
}

std::optional<double> Evaluator::uncertainty_m(const Eigen::Vector3d& p_tracked_m, std::optional<int> sensor) const {
  const correctors::PositionModel& position = *of(sensor).position;
  return position.covers(p_tracked_m) ? position.uncertainty_m(p_tracked_m) : std::nullopt;
}

std::optional<double> Evaluator::uncertaintyAt_m(const Pose& tracker_from_sensor, std::optional<int> sensor) const {
  const correctors::PositionModel& position = *of(sensor).position;
  return position.covers(tracker_from_sensor.position_m) ? position.uncertaintyAt_m(tracker_from_sensor) : std::nullopt;
}

bool Evaluator::covers(const Eigen::Vector3d& p_tracked_m, std::optional<int> sensor) const {
  const Correction& correction = of(sensor);
  return correction.region.contains(p_tracked_m) && correction.position->covers(p_tracked_m);
}

Eigen::Matrix3d Evaluator::jacobian(const Eigen::Vector3d& p_tracked_m) const {
  return parts_.position->covers(p_tracked_m) ? Eigen::Matrix3d(rotation_ * parts_.position->jacobian(p_tracked_m))
                                              : rotation_;
}

}  // namespace fieldtrue::calibration
