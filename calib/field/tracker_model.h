#pragma once

#include <Eigen/Core>
#include <optional>

#include "calib/core/pose.h"
#include "calib/field/effect.h"

/// What a tracker that knows the undistorted dipole field alone makes of a distorted one: the pose that it reports, and
/// how that answers to the field.
namespace fieldtrue::field {

/// Adds a response times a factor to a sum.
void add(const EffectResponse& part, double factor, EffectResponse& sum);

/// The pose with a response's shift and turn.
Pose displaced(const Pose& stated, const EffectResponse& response);

/// The pose that a tracker reports at a setting whose effects respond so; none where it solves none.
/// @param near_m decides between p and -p, tracker frame [m]
std::optional<Pose> reportedPose(const SensorSetting& setting, const EffectResponse& response,
                                 const Eigen::Vector3d& near_m);

/// The field matrix at the sensor of a setting whose effects respond so, in units in which the transmitter's own is
/// G(p; C = 1).
Eigen::Matrix3d totalField_per_m3(const SensorSetting& setting, const EffectResponse& response);

/// Derivative of the solved pose (position, rotation vector in the tracker frame) by the nine field components
/// (column-major) for a tracker that takes the unweighted least-squares dipole: (B^T B)^-1 B^T, B = [dG/dp, -[e_k]x G].
/// @param p_m solved position, C = 1
Eigen::Matrix<double, 6, 9> poseByField(const Eigen::Vector3d& p_m);

/// d position / d field matrix (column-major, 9 columns) of a tracker that solves the undistorted dipole for its place.
using PositionDerivative = Eigen::Matrix<double, 3, 9>;

/// The position a dipole tracker solves from a 3x3 field matrix at the sensor, in units in which the transmitter's own
/// field is G. The sensor's orientation drops out: only B^T B counts.
/// @param near_m decides between p and -p [m]
/// @source as solvePose (pose_solver.h): u = q1, |p|^-3 = (2 d1 + d2 + s d3)/6
Eigen::Vector3d solvedPosition_m(const Eigen::Matrix3d& field, const Eigen::Vector3d& near_m);

/// Its derivative, by first-order perturbation of the singular values and vectors.
PositionDerivative solvedPositionDerivative(const Eigen::Matrix3d& field, const Eigen::Vector3d& near_m);

}  // namespace fieldtrue::field
