#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "calib/effects/registry.h"
#include "calib/field/pose_solver.h"

namespace fieldtrue::testing {

/// The distortion of an effect, or the test's abort when it cannot be made.
inline std::unique_ptr<field::CouplingDistortion> made(const std::string& id, const nlohmann::json& parameters) {
  auto effect = effects::makeEffect(id, parameters);
  if (!effect) throw std::runtime_error(effect.error().message);
  return std::unique_ptr<field::CouplingDistortion>(&dynamic_cast<field::CouplingDistortion&>(*effect->release()));
}

/// What a tracker at the origin makes of a sensor with the identity orientation under one distortion, C = 1.
inline Pose trackedPose(const field::CouplingDistortion& distortion, const Eigen::Vector3d& p_true_m) {
  const Eigen::Matrix3d field = field::dipoleField(p_true_m, 1.0) + distortion.fieldChange(p_true_m, 1.0, 0.0);
  return field::solvePose(field, 1.0, p_true_m).value().tracker_from_sensor;
}

}  // namespace fieldtrue::testing
