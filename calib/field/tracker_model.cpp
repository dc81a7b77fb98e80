#include "calib/field/tracker_model.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"

namespace fieldtrue::field {

void add(const EffectResponse& part, double factor, EffectResponse& sum) {
  sum.shift_m += factor * part.shift_m;
  sum.turn_rad += factor * part.turn_rad;
  sum.field_per_m3 += factor * part.field_per_m3;
}

Pose displaced(const Pose& stated, const EffectResponse& response) {
  Pose actual = stated;
  actual.position_m += response.shift_m;
  if (response.turn_rad.squaredNorm() > 0.0) {
    actual.orientation = (rotationFromVector(response.turn_rad) * stated.orientation).normalized();
  }
  return actual;
}

Eigen::Matrix3d totalField_per_m3(const SensorSetting& setting, const EffectResponse& response) {
  return dipoleField(setting.tracker_from_sensor.position_m + response.shift_m, 1.0) + response.field_per_m3;
}

std::optional<Pose> reportedPose(const SensorSetting& setting, const EffectResponse& response,
                                 const Eigen::Vector3d& near_m) {
  const Pose actual = displaced(setting.tracker_from_sensor, response);
  const Eigen::Matrix3d field = dipoleField(actual.position_m, 1.0) + response.field_per_m3;
  const auto solution = solvePose(couplings(field, actual.orientation), 1.0, near_m);
  if (!solution) return std::nullopt;
  return solution->tracker_from_sensor;
}

/// In a frame along p the six columns of B are three orthogonal pairs, so that the least squares is written down. For a
/// small change H of the field, u = p/r and v the axial vector of H - H^T:
///   dp    = r^4/3 (2 H^T u - H u + (tr H/6 - 3/2 u.Hu) u)
///   dturn = r^3 (3/2 (u.v) u - v)
Eigen::Matrix<double, 6, 9> poseByField(const Eigen::Vector3d& p_m) {
  const double r_m = p_m.norm();
  const Eigen::Vector3d u = p_m / r_m;
  const double turn = r_m * r_m * r_m;
  const double shift = turn * r_m / 3.0;
  Eigen::Matrix<double, 6, 9> by_field;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d shifted = ((i == j ? 1.0 / 6.0 : 0.0) - 1.5 * u[i] * u[j]) * u;
      shifted[j] += 2.0 * u[i];
      shifted[i] -= u[j];
      const Eigen::Vector3d axial = Eigen::Vector3d::Unit(j).cross(Eigen::Vector3d::Unit(i));
      by_field.col(3 * j + i) << shift * shifted, turn * (1.5 * axial.dot(u) * u - axial);
    }
  }
  return by_field;
}

Eigen::Vector3d solvedPosition_m(const Eigen::Matrix3d& field, const Eigen::Vector3d& near_m) {
  const Eigen::Matrix3d squared = field.transpose() * field;
  if (!(squared.trace() > 0.0) || !squared.allFinite()) return near_m;
  const Eigen::Vector3d u = dominantDirection(squared);
  const double d1 = std::sqrt(u.dot(squared * u));
  // (d2 + s d3)^2 = d2^2 + d3^2 + 2 s d2 d3, and s d1 d2 d3 is the determinant.
  const double rest = squared.trace() - d1 * d1 + 2.0 * field.determinant() / d1;
  const double k = (2.0 * d1 + std::sqrt(std::max(0.0, rest))) / 6.0;
  const Eigen::Vector3d p_m = u / std::cbrt(k);
  return p_m.dot(near_m) < 0.0 ? Eigen::Vector3d(-p_m) : p_m;
}

PositionDerivative solvedPositionDerivative(const Eigen::Matrix3d& field, const Eigen::Vector3d& near_m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(field, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  const Eigen::Matrix3d& P = svd.matrixU();
  const Eigen::Matrix3d& Q = svd.matrixV();
  const double s = field.determinant() < 0.0 ? -1.0 : 1.0;
  const double k = (2.0 * d[0] + d[1] + s * d[2]) / 6.0;
  const double r_m = 1.0 / std::cbrt(k);
  const Eigen::Vector3d weight(2.0 / 6.0, 1.0 / 6.0, s / 6.0);
  PositionDerivative derivative;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      double dk = 0.0;
      for (int j = 0; j < 3; ++j) dk += weight[j] * P(a, j) * Q(b, j);
      Eigen::Vector3d du = Eigen::Vector3d::Zero();
      for (int j = 1; j < 3; ++j) {
        const double along = d[0] * P(a, 0) * Q(b, j) + d[j] * P(a, j) * Q(b, 0);
        du += along / (d[0] * d[0] - d[j] * d[j]) * Q.col(j);
      }
      derivative.col(3 * b + a) = r_m * (du - dk / (3.0 * k) * Q.col(0));
    }
  }
  return Q.col(0).dot(near_m) < 0.0 ? PositionDerivative(-derivative) : derivative;
}

}  // namespace fieldtrue::field
