#pragma once

#include <Eigen/Core>

#include "calib/core/pose.h"

namespace fieldtrue::field {

/// Field of three unit orthogonal dipoles at the origin, at p: G(p) = C (3uu^T - I)/r^3; column k is the field of
/// dipole k. Symmetric, even in p, eigenvalues C/r^3 (2, -1, -1).
/// @param p_m in the dipoles' frame [m]; at the origin the result is not finite
/// @param dipole_constant_m3 C
/// @source Raab 1979; Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709
Eigen::Matrix3d dipoleField(const Eigen::Vector3d& p_m, double dipole_constant_m3);

/// d dipoleField / d p along one axis: 3 C/r^4 (e u^T + u e^T - u_a (5 u u^T - 1)).
/// @param axis 0, 1, 2 of the dipoles' frame
Eigen::Matrix3d dipoleFieldSlope(const Eigen::Vector3d& p_m, double dipole_constant_m3, int axis);

/// The nine couplings S = R^T G: rows receiver coils, columns transmitter coils.
/// @param field G and what was added to it, tracker frame
Eigen::Matrix3d couplings(const Eigen::Matrix3d& field, const Eigen::Quaterniond& tracker_from_sensor);

}  // namespace fieldtrue::field
