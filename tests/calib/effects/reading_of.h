#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "calib/effects/registry.h"
#include "calib/field/pose_solver.h"

namespace fieldtrue::testing {

/// The effect of an id, or the test's abort when it cannot be made.
inline std::unique_ptr<field::PhysicalEffect> effectOf(const std::string& id, const nlohmann::json& parameters) {
  auto effect = effects::makeEffect(id, parameters);
  if (!effect) throw std::runtime_error(effect.error().message);
  return std::move(*effect);
}

inline field::SensorSetting settingAt(const Pose& tracker_from_sensor, const Pose& tracker_from_reference = {},
                                      double time_s = 0.0) {
  return {tracker_from_sensor, tracker_from_reference, std::nullopt, time_s};
}

/// The couplings with one effect for C = 1: its shift and turn move the sensor, its field adds to the dipoles'.
inline Eigen::Matrix3d couplingsWith(const field::PhysicalEffect& effect, const field::SensorSetting& setting) {
  const field::EffectResponse response = effect.at(setting);
  Pose actual = setting.tracker_from_sensor;
  actual.position_m += response.shift_m;
  actual.orientation = rotationFromVector(response.turn_rad) * actual.orientation;
  return field::couplings(field::dipoleField(actual.position_m, 1.0) + response.field_per_m3, actual.orientation);
}

/// What a tracker reports that knows nothing of the effect.
inline Pose readingOf(const field::PhysicalEffect& effect, const field::SensorSetting& setting) {
  return field::solvePose(couplingsWith(effect, setting), 1.0, setting.tracker_from_sensor.position_m)
      .value()
      .tracker_from_sensor;
}

/// The way of an effect's fits with a name.
inline std::unique_ptr<effects::EffectFit> wayOf(const std::string& id, const effects::FitDesign& design,
                                                 const std::string& name) {
  for (auto& way : effects::findEffect(id).value()->fits(design)) {
    if (way->name() == name) return std::move(way);
  }
  throw std::runtime_error(id + " has no way " + name);
}

}  // namespace fieldtrue::testing
