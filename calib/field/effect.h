#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "calib/core/pose.h"

namespace fieldtrue::field {

/// How the transmitter is driven and read.
struct Excitation {
  bool is_pulsed_dc = false;
  double carrier_hz = 10016.0;    ///< AC only.
  double sampling_delay_s = 0.0;  ///< Pulsed DC only: from the pulse's edge to the reading.
};

/// One reading as the rig and the alignment tell it: all that an effect may depend on.
struct SensorSetting {
  Pose tracker_from_sensor;                 ///< Where the sensor should be.
  Pose tracker_from_reference;              ///< The rig's frame in the tracker's.
  std::optional<std::array<int, 3>> index;  ///< Grid index i j k; none when scattered.
  double time_s = 0.0;                      ///< From the start of the session.
  /// Where the rig put the holder, rig's frame; none where the sensor has no holder of its own.
  std::optional<Eigen::Vector3d> holder_m = std::nullopt;
};

/// What effects change at one reading, to first order: contributions of several effects add.
struct EffectResponse {
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< Actual minus stated sensor position, tracker frame.
  /// Actual from stated orientation, rotation vector, tracker frame.
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();
  /// Change of the 3x3 field matrix at the sensor (rows: field components in the tracker frame, columns: transmitter
  /// coils) in units in which the undisturbed field is G(p; C = 1) [1/m^3]. A receiver's own error E, which turns S
  /// into (1 + E) S, is R E R^T G here.
  Eigen::Matrix3d field_per_m3 = Eigen::Matrix3d::Zero();
};

/// What the tracker's electronics make of a signal, as effects change it.
struct SignalModel {
  double noise_factor = 1.0;       ///< Of the SD of each coupling.
  double noise_range_power = 0.0;  ///< The SD of each coupling further grows as (r / 1 m)^power.
  double correlation = 0.0;        ///< Between successive readings, [0, 1).
  double quantum_m = 0.0;          ///< Lattice of reported positions; 0 = none.
  double quantum_rad = 0.0;        ///< Step of reported rotation vectors; 0 = none.
  double flip_probability = 0.0;   ///< That a visit is reported in the other hemisphere, -p.
};

/// One thing that makes a real tracker differ from an ideal one in free space.
class PhysicalEffect {
 public:
  virtual ~PhysicalEffect() = default;
  /// What it changes at one reading.
  virtual EffectResponse at([[maybe_unused]] const SensorSetting& setting) const { return {}; }
  /// Whether a sensor there stands in the open. False inside metal or behind a plane: no signal arrives and `at` does
  /// not hold.
  /// @param p_sensor_m tracker frame [m]
  virtual bool admits([[maybe_unused]] const Eigen::Vector3d& p_sensor_m) const { return true; }
  /// What it changes in the electronics.
  virtual void disturb([[maybe_unused]] SignalModel& signal) const {}
  /// A signal that the receiver's coils pick up besides the transmitter's, added to the 3x3 couplings (rows receiver
  /// coils) in units in which the transmitter's are R^T G(p; C = 1) [1/m^3].
  virtual Eigen::Matrix3d interference_per_m3([[maybe_unused]] double time_s) const { return Eigen::Matrix3d::Zero(); }
};

/// An effect of the room: metal that changes the field wherever the sensor is.
class CouplingDistortion : public PhysicalEffect {
 public:
  /// Change of the 3x3 field matrix at the sensor, tracker frame (rows: field components, columns: transmitter coils).
  virtual Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                                      double time_s) const = 0;
  EffectResponse at(const SensorSetting& setting) const final {
    EffectResponse response;
    response.field_per_m3 = fieldChange(setting.tracker_from_sensor.position_m, 1.0, setting.time_s);
    return response;
  }
};

}  // namespace fieldtrue::field
