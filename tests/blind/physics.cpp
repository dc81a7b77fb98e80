#include "tests/blind/physics.h"

#include <cmath>

namespace blind {

Matrix3d dipoleField(const Vector3d& p_m) {
  const double r2 = p_m.squaredNorm();
  const double r = std::sqrt(r2);
  return (3.0 / r2 * p_m * p_m.transpose() - Matrix3d::Identity()) / (r2 * r);
}

Complex apparentPermeability(double radius_m, double relative_permeability, double conductivity_s_m,
                             double frequency_hz) {
  constexpr double kMu0 = 4e-7 * kPi;
  const double k2 = 2 * kPi * frequency_hz * kMu0 * relative_permeability * conductivity_s_m * radius_m * radius_m;
  if (k2 < 1e-6) return relative_permeability;
  const Complex x = std::sqrt(Complex(0, -k2));
  // cot(x) for Im x << 0 is +i: the exponential form never overflows.
  const Complex e = std::exp(Complex(0, -2) * x);
  const Complex cot = Complex(0, 1) * (1.0 + e) / (1.0 - e);
  const Complex xcot = x * cot;
  return relative_permeability * 2.0 * (1.0 - xcot) / (x * x - 1.0 + xcot);
}

Quaterniond turned(const Vector3d& rotation_rad, const Quaterniond& q) {
  const double angle = rotation_rad.norm();
  if (angle < 1e-14) return q;
  return (Quaterniond(Eigen::AngleAxisd(angle, rotation_rad / angle)) * q).normalized();
}

Vector3d rotationVector(const Quaterniond& q) {
  const Quaterniond p = q.w() < 0 ? Quaterniond(-q.coeffs()) : q;
  const double sine = p.vec().norm();
  return sine < 1e-12 ? Vector3d(2 * p.vec()) : Vector3d(2 * std::atan2(sine, p.w()) / sine * p.vec());
}

Matrix3d skew(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

double uniform(Random& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1.0p-53);
}

double logUniform(Random& random, double low, double high) {
  return std::exp(uniform(random, std::log(low), std::log(high)));
}

double normal(Random& random) {
  const double u = uniform(random, 1e-300, 1.0);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * uniform(random, 0, 1));
}

int uniformInt(Random& random, int low, int high) {
  return low + static_cast<int>(random() % static_cast<std::uint64_t>(high - low + 1));
}

Vector3d normalVector(Random& random) {
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}

Vector3d direction(Random& random) { return normalVector(random).normalized(); }

Quaterniond rotation(Random& random) {
  const Vector3d v = normalVector(random);
  return Quaterniond(normal(random), v.x(), v.y(), v.z()).normalized();
}

}  // namespace blind
