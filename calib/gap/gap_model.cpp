#include "calib/gap/gap_model.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/core/geometry.h"
#include "calib/core/statistics.h"
#include "calib/field/coupling.h"
#include "calib/field/pose_solver.h"

namespace fieldtrue {
namespace {

void add(const EffectResponse& part, double factor, EffectResponse& sum) {
  sum.shift_m += factor * part.shift_m;
  sum.turn_rad += factor * part.turn_rad;
  sum.field_per_m3 += factor * part.field_per_m3;
}

}  // namespace

std::vector<SensorSetting> GapPhysics::settings(const GapAlignment& alignment) const {
  std::vector<SensorSetting> settings;
  settings.reserve(size());
  for (const GapRow& row : rows_.rows) {
    settings.push_back({alignment.tracker_from_reference * row.reference_from_sensor * alignment.mount_from_sensor,
                        alignment.tracker_from_reference, row.index, row.time_s});
  }
  return settings;
}

std::vector<EffectResponse> GapPhysics::responses(const GapModel& model,
                                                  std::span<const SensorSetting> settings) const {
  std::vector<EffectResponse> sum(settings.size());
  for (const auto& effect : believed_)
    for (std::size_t i = 0; i < settings.size(); ++i) add(effect->at(settings[i]), 1.0, sum[i]);
  std::vector<EffectResponse> unit;
  for (const GapTerm& term : model.terms) {
    const auto m = static_cast<std::size_t>(term.linear.size());
    unit.assign(settings.size() * m, {});
    term.fit->respond(settings, term.searched, unit);
    for (std::size_t i = 0; i < settings.size(); ++i)
      for (std::size_t j = 0; j < m; ++j) add(unit[i * m + j], term.linear[static_cast<Eigen::Index>(j)], sum[i]);
  }
  return sum;
}

bool GapPhysics::solvedPose(const SensorSetting& setting, const EffectResponse& response, const Eigen::Vector3d& near_m,
                            Pose& pose) const {
  const Eigen::Vector3d p_m = setting.tracker_from_sensor.position_m + response.shift_m;
  const Eigen::Quaterniond q = rotationFromVector(response.turn_rad) * setting.tracker_from_sensor.orientation;
  const Eigen::Matrix3d field = dipoleField(p_m, 1.0) + response.field_per_m3;
  const auto solution = solvePose(couplings(field, q), 1.0, near_m);
  if (!solution) return false;
  pose = solution->tracker_from_sensor;
  return true;
}

std::vector<Pose> GapPhysics::predictions(const GapModel& model) const {
  const std::vector<SensorSetting> at = settings(model.alignment);
  const std::vector<EffectResponse> sum = responses(model, at);
  std::vector<Pose> poses(size());
  for (std::size_t i = 0; i < size(); ++i) {
    if (!solvedPose(at[i], sum[i], rows_.rows[i].tracker_from_sensor.position_m, poses[i])) {
      poses[i].position_m = rows_.rows[i].tracker_from_sensor.position_m + Eigen::Vector3d::Constant(1.0);
      poses[i].orientation =
          rotationFromVector(Eigen::Vector3d::Constant(0.6)) * rows_.rows[i].tracker_from_sensor.orientation;
    }
  }
  return poses;
}

std::vector<Vector6d> GapPhysics::residuals(const GapModel& model) const {
  const std::vector<Pose> poses = predictions(model);
  std::vector<Vector6d> residuals(size(), Vector6d::Zero());
  for (std::size_t i = 0; i < size(); ++i) {
    const Pose& tracked = rows_.rows[i].tracker_from_sensor;
    residuals[i].head<3>() = tracked.position_m - poses[i].position_m;
    if (rows_.has_orientation)
      residuals[i].tail<3>() = rotationVector_rad(tracked.orientation * poses[i].orientation.conjugate());
  }
  return residuals;
}

Eigen::Matrix<double, 6, 9> poseByField(const Eigen::Vector3d& p_m) {
  const double r_m = p_m.norm();
  const Eigen::Vector3d u = p_m / r_m;
  const double k = 1.0 / (r_m * r_m * r_m);
  const Eigen::Matrix3d G = k * (3.0 * u * u.transpose() - Eigen::Matrix3d::Identity());
  Eigen::Matrix<double, 9, 6> B;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(axis);
    const Eigen::Matrix3d dG =
        3.0 * k / r_m *
        (e * u.transpose() + u * e.transpose() - u[axis] * (5.0 * u * u.transpose() - Eigen::Matrix3d::Identity()));
    Eigen::Matrix3d turned;
    for (int column = 0; column < 3; ++column) turned.col(column) = -e.cross(Eigen::Vector3d(G.col(column)));
    B.col(axis) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dG.data());
    B.col(3 + axis) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(turned.data());
  }
  const Matrix6d normal = B.transpose() * B;
  return normal.ldlt().solve(B.transpose());
}

GapAlignment initialAlignment(const GapRows& table) {
  GapAlignment alignment;
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
  std::vector<Eigen::Quaterniond> mounting;
  for (const GapRow& row : table.rows) {
    const Eigen::Quaterniond tracker_from_mount =
        alignment.tracker_from_reference.orientation * row.reference_from_sensor.orientation;
    mounting.push_back(tracker_from_mount.conjugate() * row.tracker_from_sensor.orientation);
  }
  alignment.mount_from_sensor.orientation = meanRotation(mounting);
  return alignment;
}

}  // namespace fieldtrue
