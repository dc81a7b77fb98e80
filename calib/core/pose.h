#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace fieldtrue {

/// A rigid transform `b_from_a`: x_in_b_m = orientation * x_in_a_m + position_m. The frames are in the variable's name.
struct Pose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< Hamilton, unit.
};

/// c_from_a = c_from_b * b_from_a.
Pose operator*(const Pose& c_from_b, const Pose& b_from_a);

/// x_in_b_m of a point given in a [m].
Eigen::Vector3d operator*(const Pose& b_from_a, const Eigen::Vector3d& x_in_a_m);

/// a_from_b of b_from_a.
Pose inverse(const Pose& b_from_a);

/// The same rotation as a unit quaternion with w >= 0 (the form written to files).
/// @param q any quaternion of non-zero norm
Eigen::Quaterniond canonical(const Eigen::Quaterniond& q);

/// Rotation vector (axis times angle) of a rotation [rad], angle in [0, pi].
Eigen::Vector3d rotationVector_rad(const Eigen::Quaterniond& q);

/// Rotation of a rotation vector [rad]; the inverse of rotationVector_rad.
Eigen::Quaterniond rotationFromVector(const Eigen::Vector3d& rotation_vector_rad);

/// Angle between two rotations [rad], in [0, pi]; q and -q are the same rotation.
double angleBetween_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Rotation of azimuth about Z, then elevation about the new Y, then roll about the new X: R = Rz(az) Ry(el) Rx(roll)
/// [rad], the convention of Polhemus and Ascension.
Eigen::Quaterniond rotationFromEuler(const Eigen::Vector3d& azimuth_elevation_roll_rad);

/// The inverse of rotationFromEuler; elevation in [-pi/2, pi/2], at the gimbal poles roll is 0.
Eigen::Vector3d eulerFromRotation_rad(const Eigen::Quaterniond& q);

}  // namespace fieldtrue
