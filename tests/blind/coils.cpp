#include "tests/blind/coils.h"

#include <cmath>

namespace blind {

Polygon roundLoop(const Vector3d& center_m, const Vector3d& normal, double radius_m, int corners) {
  const Vector3d n = normal.normalized();
  const Vector3d u = n.unitOrthogonal();
  const Vector3d v = n.cross(u);
  const double step = 2 * kPi / corners;
  const double corner_radius_m = radius_m * std::sqrt(step / std::sin(step));
  Polygon polygon;
  for (int k = 0; k < corners; ++k)
    polygon.push_back(center_m + corner_radius_m * (std::cos(k * step) * u + std::sin(k * step) * v));
  return polygon;
}

Polygon rectangle(const Vector3d& center_m, const Vector3d& half_a_m, const Vector3d& half_b_m) {
  return {center_m - half_a_m - half_b_m, center_m + half_a_m - half_b_m, center_m + half_a_m + half_b_m,
          center_m - half_a_m + half_b_m};
}

Vector3d loopField(const Polygon& polygon, const Vector3d& p_m) {
  Vector3d field = Vector3d::Zero();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector3d a = p_m - polygon[k];
    const Vector3d b = p_m - polygon[(k + 1) % polygon.size()];
    const double na = a.norm(), nb = b.norm();
    field += a.cross(b) * (na + nb) / (na * nb * (na * nb + a.dot(b)));
  }
  return field;
}

Vector3d areaVector(const Polygon& polygon) {
  Vector3d area = Vector3d::Zero();
  for (std::size_t k = 0; k < polygon.size(); ++k)
    area += (polygon[k] - polygon[0]).cross(polygon[(k + 1) % polygon.size()] - polygon[0]);
  return 0.5 * area;
}

Eigen::RowVector3d dipoleFlux(const Polygon& polygon) {
  constexpr double kNodes[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
  constexpr double kWeights[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
  Eigen::RowVector3d flux = Eigen::RowVector3d::Zero();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector3d half = 0.5 * (polygon[(k + 1) % polygon.size()] - polygon[k]);
    for (int q = 0; q < 4; ++q) {
      const Vector3d r = polygon[k] + (1 + kNodes[q]) * half;
      // (m x r) . dl = m . (r x dl)
      flux += kWeights[q] * r.cross(half).transpose() / std::pow(r.squaredNorm(), 1.5);
    }
  }
  return flux;
}

double roundLoopInductance(double radius_m, double wire_radius_m) {
  return 4e-7 * kPi * radius_m * (std::log(8 * radius_m / wire_radius_m) - 2);
}

Matrix3d coilCouplings(const Vector3d& p_m, const Matrix3d& tracker_from_sensor, double transmitter_half_m,
                       double receiver_half_m) {
  const auto field = [&](const Vector3d& at) {
    if (transmitter_half_m <= 0) return dipoleField(at);
    Matrix3d columns;
    for (int coil = 0; coil < 3; ++coil) {
      const Vector3d a = transmitter_half_m * Vector3d::Unit((coil + 1) % 3);
      const Vector3d b = transmitter_half_m * Vector3d::Unit((coil + 2) % 3);
      columns.col(coil) =
          loopField(rectangle(Vector3d::Zero(), a, b), at) / (4 * transmitter_half_m * transmitter_half_m);
    }
    return columns;
  };
  if (receiver_half_m <= 0) return tracker_from_sensor.transpose() * field(p_m);
  Matrix3d couplings;
  const double g = receiver_half_m / std::sqrt(3.0);
  for (int coil = 0; coil < 3; ++coil) {
    const Vector3d a = g * tracker_from_sensor.col((coil + 1) % 3);
    const Vector3d b = g * tracker_from_sensor.col((coil + 2) % 3);
    const Matrix3d mean = 0.25 * (field(p_m + a + b) + field(p_m + a - b) + field(p_m - a + b) + field(p_m - a - b));
    couplings.row(coil) = tracker_from_sensor.col(coil).transpose() * mean;
  }
  return couplings;
}

}  // namespace blind
