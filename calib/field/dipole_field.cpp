#include "calib/field/dipole_field.h"

namespace fieldtrue::field {

Eigen::Matrix3d dipoleField(const Eigen::Vector3d& p_m, double dipole_constant_m3) {
  const double r_m = p_m.norm();
  const Eigen::Vector3d u = p_m / r_m;
  return dipole_constant_m3 / (r_m * r_m * r_m) * (3.0 * u * u.transpose() - Eigen::Matrix3d::Identity());
}

Eigen::Matrix3d dipoleFieldSlope(const Eigen::Vector3d& p_m, double dipole_constant_m3, int axis) {
  const double r_m = p_m.norm();
  const Eigen::Vector3d u = p_m / r_m;
  const Eigen::Vector3d e = Eigen::Vector3d::Unit(axis);
  const double k = dipole_constant_m3 / (r_m * r_m * r_m);
  return 3.0 * k / r_m *
         (e * u.transpose() + u * e.transpose() - u[axis] * (5.0 * u * u.transpose() - Eigen::Matrix3d::Identity()));
}

Eigen::Matrix3d couplings(const Eigen::Matrix3d& field, const Eigen::Quaterniond& tracker_from_sensor) {
  return tracker_from_sensor.toRotationMatrix().transpose() * field;
}

}  // namespace fieldtrue::field
