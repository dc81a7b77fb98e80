#include "calib/identify/model.h"

#include <algorithm>

#include "calib/core/statistics.h"
#include "calib/field/tracker_model.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::identify {
namespace {

bool isSame(const Pose& a, const Pose& b) {
  return a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs();
}

bool isSame(const GapTerm& a, const GapTerm& b) {
  return a.fit == b.fit && a.searched == b.searched && a.linear == b.linear;
}

}  // namespace

bool isSame(const GapModel& a, const GapModel& b) {
  const auto same = [](const auto& one, const auto& other) { return isSame(one, other); };
  return isSame(a.alignment.tracker_from_reference, b.alignment.tracker_from_reference) &&
         std::ranges::equal(a.alignment.mount_from_sensor, b.alignment.mount_from_sensor, same) &&
         std::ranges::equal(a.terms, b.terms, same);
}

Eigen::Index parametersOf(const GapModel& model) {
  Eigen::Index count = 0;
  for (const GapTerm& term : model.terms) count += term.linear.size() + term.searched.size();
  return count;
}

GapModel withoutTerm(GapModel model, std::size_t term) {
  model.terms.erase(model.terms.begin() + static_cast<std::ptrdiff_t>(term));
  return model;
}

std::vector<field::SensorSetting> GapPhysics::settings(const GapAlignment& alignment) const {
  std::vector<field::SensorSetting> settings;
  settings.reserve(size());
  for (const GapRow& row : rows_.rows) {
    settings.push_back(
        {alignment.tracker_from_reference * row.reference_from_sensor * alignment.mount_from_sensor[row.sensor],
         alignment.tracker_from_reference, row.index, row.time_s, row.reference_from_sensor.position_m});
  }
  return settings;
}

std::vector<field::EffectResponse> GapPhysics::responses(const GapModel& model,
                                                         std::span<const field::SensorSetting> settings) const {
  std::vector<field::EffectResponse> sum(settings.size());
  for (const auto& effect : believed_)
    for (std::size_t i = 0; i < settings.size(); ++i) field::add(effect->at(settings[i]), 1.0, sum[i]);
  std::vector<field::EffectResponse> unit;
  for (const GapTerm& term : model.terms) {
    const auto m = static_cast<std::size_t>(term.linear.size());
    unit.assign(settings.size() * m, {});
    term.fit->respond(settings, term.searched, unit);
    for (std::size_t i = 0; i < settings.size(); ++i)
      for (std::size_t j = 0; j < m; ++j)
        field::add(unit[i * m + j], term.linear[static_cast<Eigen::Index>(j)], sum[i]);
  }
  return sum;
}

std::vector<Pose> GapPhysics::predictions(const GapModel& model) const {
  const std::vector<field::SensorSetting> at = settings(model.alignment);
  const std::vector<field::EffectResponse> sum = responses(model, at);
  std::vector<Pose> poses(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const Pose& tracked = rows_.rows[i].tracker_from_sensor;
    const auto reported = field::reportedPose(at[i], sum[i], tracked.position_m);
    poses[i] = reported.value_or(Pose{tracked.position_m + Eigen::Vector3d::Constant(1.0),
                                      rotationFromVector(Eigen::Vector3d::Constant(0.6)) * tracked.orientation});
  }
  return poses;
}

std::vector<Vector6d> GapPhysics::residuals(std::span<const Pose> predicted) const {
  std::vector<Vector6d> residuals(size(), Vector6d::Zero());
  for (std::size_t i = 0; i < size(); ++i) {
    const Pose& tracked = rows_.rows[i].tracker_from_sensor;
    residuals[i].head<3>() = tracked.position_m - predicted[i].position_m;
    if (rows_.has_orientation)
      residuals[i].tail<3>() = rotationVector_rad(tracked.orientation * predicted[i].orientation.conjugate());
  }
  return residuals;
}

std::vector<Eigen::Quaterniond> meanMountings(const GapRows& table, const Pose& tracker_from_reference) {
  std::vector<std::vector<Eigen::Quaterniond>> seen(table.sensors.size());
  for (const GapRow& row : table.rows) {
    const Eigen::Quaterniond tracker_from_mount =
        tracker_from_reference.orientation * row.reference_from_sensor.orientation;
    seen[row.sensor].push_back(tracker_from_mount.conjugate() * row.tracker_from_sensor.orientation);
  }
  std::vector<Eigen::Quaterniond> mean;
  for (const std::vector<Eigen::Quaterniond>& of_sensor : seen) mean.push_back(meanRotation(of_sensor));
  return mean;
}

GapAlignment initialAlignment(const GapRows& table) {
  GapAlignment alignment;
  alignment.mount_from_sensor.resize(table.sensors.size());
  alignment.tracker_from_reference = table.stated_tracker_from_reference;
  if (table.alignment_known) return alignment;
  std::vector<Eigen::Vector3d> p_true_m;
  std::vector<Eigen::Vector3d> p_tracked_m;
  for (const GapRow& row : table.rows) {
    p_true_m.push_back(row.reference_from_sensor.position_m);
    p_tracked_m.push_back(row.tracker_from_sensor.position_m);
  }
  if (const auto rigid = fitRigid(p_true_m, p_tracked_m)) alignment.tracker_from_reference = *rigid;
  if (!table.has_orientation) return alignment;
  const std::vector<Eigen::Quaterniond> mountings = meanMountings(table, alignment.tracker_from_reference);
  for (std::size_t s = 0; s < mountings.size(); ++s) alignment.mount_from_sensor[s].orientation = mountings[s];
  return alignment;
}

}  // namespace fieldtrue::identify
