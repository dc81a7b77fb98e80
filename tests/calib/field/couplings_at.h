#pragma once

#include "calib/field/dipole_field.h"

namespace fieldtrue::testing {

/// Constant of the field of the transmitter in tests.
constexpr double kC = 2.5;

/// What an undisturbed tracker receives at a pose.
inline Eigen::Matrix3d couplingsAt(const Pose& tracker_from_sensor) {
  return field::couplings(field::dipoleField(tracker_from_sensor.position_m, kC), tracker_from_sensor.orientation);
}

}  // namespace fieldtrue::testing
