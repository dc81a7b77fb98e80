#include "calib/core/pose.h"

#include <cmath>

#include "calib/core/error.h"

namespace fieldtrue {

namespace {

/// Below this sine or cosine of an angle its neighbours in the Euler triple cannot be told apart.
constexpr double kPole = 1e-9;

bool firstNonZeroIsNegative(const Eigen::Quaterniond& q) {
  for (const double part : {q.w(), q.x(), q.y(), q.z()}) {
    if (part != 0.0) return part < 0.0;
  }
  return false;
}

}  // namespace

Pose operator*(const Pose& c_from_b, const Pose& b_from_a) {
  return {c_from_b * b_from_a.position_m, c_from_b.orientation * b_from_a.orientation};
}

Eigen::Vector3d operator*(const Pose& b_from_a, const Eigen::Vector3d& x_in_a_m) {
  return b_from_a.orientation * x_in_a_m + b_from_a.position_m;
}

Pose inverse(const Pose& b_from_a) {
  const Eigen::Quaterniond a_from_b = b_from_a.orientation.conjugate();
  return {-(a_from_b * b_from_a.position_m), a_from_b};
}

Eigen::Quaterniond canonical(const Eigen::Quaterniond& q) {
  FT_CHECK(q.norm() > 0.0);
  Eigen::Quaterniond unit = q.normalized();
  if (firstNonZeroIsNegative(unit)) unit.coeffs() = -unit.coeffs();
  return unit;
}

Eigen::Vector3d rotationVector_rad(const Eigen::Quaterniond& q) {
  const Eigen::Quaterniond unit = canonical(q);
  const double sine = unit.vec().norm();
  if (sine == 0.0) return Eigen::Vector3d::Zero();
  return unit.vec() * (2.0 * std::atan2(sine, unit.w()) / sine);
}

Eigen::Quaterniond rotationFromVector(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle_rad = rotation_vector_rad.norm();
  // sin(a/2)/a by its series where the quotient would lose digits; the next term is a^4/3840.
  const double scale = angle_rad < 1e-4 ? 0.5 - angle_rad * angle_rad / 48.0 : std::sin(angle_rad / 2.0) / angle_rad;
  Eigen::Quaterniond q;
  q.w() = std::cos(angle_rad / 2.0);
  q.vec() = scale * rotation_vector_rad;
  return q.normalized();
}

double angleBetween_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond difference = a.conjugate() * b;
  return 2.0 * std::atan2(difference.vec().norm(), std::abs(difference.w()));
}

Eigen::Quaterniond rotationFromEuler(const Eigen::Vector3d& azimuth_elevation_roll_rad) {
  return Eigen::AngleAxisd(azimuth_elevation_roll_rad[0], Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(azimuth_elevation_roll_rad[1], Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(azimuth_elevation_roll_rad[2], Eigen::Vector3d::UnitX());
}

Eigen::Vector3d eulerFromRotation_rad(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.normalized().toRotationMatrix();
  const double cosine_elevation = std::hypot(R(2, 1), R(2, 2));
  const double elevation = std::atan2(-R(2, 0), cosine_elevation);
  if (cosine_elevation < kPole) return {std::atan2(-R(0, 1), R(1, 1)), elevation, 0.0};
  return {std::atan2(R(1, 0), R(0, 0)), elevation, std::atan2(R(2, 1), R(2, 2))};
}

}  // namespace fieldtrue
