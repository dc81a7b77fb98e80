#include "calib/correctors/base/position_model.h"

namespace fieldtrue::correctors {

void PositionModel::correct(std::span<const Eigen::Vector3d> p_tracked_m,
                            std::span<Eigen::Vector3d> p_corrected_m) const {
  FT_CHECK(p_tracked_m.size() == p_corrected_m.size());
  for (std::size_t i = 0; i < p_tracked_m.size(); ++i)
    p_corrected_m[i] = p_tracked_m[i] + displacement_m(p_tracked_m[i]);
}

void PositionModel::correctPoses(std::span<const Pose> tracker_from_sensor,
                                 std::span<Eigen::Vector3d> p_corrected_m) const {
  FT_CHECK(tracker_from_sensor.size() == p_corrected_m.size());
  for (std::size_t i = 0; i < tracker_from_sensor.size(); ++i)
    p_corrected_m[i] = tracker_from_sensor[i].position_m + displacementAt_m(tracker_from_sensor[i]);
}

Result<std::unique_ptr<PositionModel>> PositionModel::onLattices(const LatticeMaker& maker,
                                                                 double max_deviation_m) const {
  if (takesOrientation())
    return fail(ErrorCode::kUnsupported,
                "This correction depends on how the sensor is turned in a way that lattices over position cannot hold");
  return maker.make(*this, max_deviation_m);
}

Eigen::Matrix3d PositionModel::jacobian(const Eigen::Vector3d& p_tracked_m) const {
  constexpr double kStep_m = 1e-4;
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
    jacobian.col(axis) +=
        (displacement_m(p_tracked_m + step_m) - displacement_m(p_tracked_m - step_m)) / (2.0 * kStep_m);
  }
  return jacobian;
}

}  // namespace fieldtrue::correctors
