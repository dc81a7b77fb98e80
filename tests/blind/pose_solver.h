#pragma once

#include "tests/blind/physics.h"

namespace blind {

struct SolvedPose {
  Vector3d position_m = Vector3d::Zero();
  Quaterniond orientation = Quaterniond::Identity();
};

/// Derivative of the nine couplings of point coils, columns position then rotation vector in the tracker frame.
Eigen::Matrix<double, 9, 6> couplingDerivative(const Vector3d& p_m, const Matrix3d& tracker_from_sensor);

/// Pose whose point-coil couplings are nearest to the measured ones in least squares.
/// @param couplings rows receiver coils, columns transmitter coils [m^-3]
/// @param side_m any vector on the half space the sensor is in [m]
/// @return the pose in the tracker frame, found by damped Gauss-Newton steps from the measured row lengths
SolvedPose solvePose(const Matrix3d& couplings, const Vector3d& side_m);

}  // namespace blind
