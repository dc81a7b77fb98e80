#include "calib/correctors/harmonic_field_physics.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "calib/field/coupling.h"

namespace fieldtrue {
namespace {

/// Unit eigenvector of the largest eigenvalue of a positive symmetric matrix, by repeated squaring: undistorted, the
/// others are a quarter of it, and five squarings leave 4^-32 of them.
Eigen::Vector3d dominantDirection(Eigen::Matrix3d m) {
  constexpr int kMostSquarings = 16;
  m /= m.trace();
  for (int i = 0; i < kMostSquarings; ++i) {
    const Eigen::Matrix3d squared = m * m;
    const double trace = squared.trace();
    m = squared / trace;
    if (trace > 1.0 - 1e-15) break;
  }
  Eigen::Index column = 0;
  m.diagonal().maxCoeff(&column);
  return m.col(column).normalized();
}

}  // namespace

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
  const Eigen::Vector3d d = svd.singularValues();
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

Eigen::Matrix3d DisturbedField::at(const Eigen::Vector3d& p_true_m) const {
  Eigen::Matrix3d field = dipoleField(p_true_m, 1.0);
  for (const FieldSource& source : sources_) {
    const Eigen::Vector3d from_source_m = p_true_m - source.at_m;
    const double r2 = from_source_m.squaredNorm();
    const double inverse_r3 = 1.0 / (r2 * std::sqrt(r2));
    const Eigen::RowVector3d along = from_source_m.transpose() * source.response;
    field += inverse_r3 * (3.0 / r2 * from_source_m * along - source.response);
  }
  return field;
}

Eigen::Vector3d DisturbedField::trackedPosition_m(const Eigen::Vector3d& p_true_m) const {
  return solvedPosition_m(at(p_true_m), p_true_m);
}

Eigen::Matrix3d DisturbedField::trackedJacobian(const Eigen::Vector3d& p_true_m) const {
  constexpr double kStep_m = 1e-4;
  Eigen::Matrix3d jacobian;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
    jacobian.col(axis) = (trackedPosition_m(p_true_m + step_m) - trackedPosition_m(p_true_m - step_m)) / (2 * kStep_m);
  }
  return jacobian;
}

Eigen::Vector3d DisturbedField::truePosition_m(const Eigen::Vector3d& p_tracked_m) const {
  if (sources_.empty()) return p_tracked_m;
  constexpr int kMostSteps = 60;
  constexpr double kNear = 1e-11;        // Of the range: 30 pm at 3 m.
  constexpr double kLongestStep = 0.25;  // Of the range: a longer one may end beyond a source.
  const double range_m = p_tracked_m.norm();
  Eigen::Matrix3d true_by_tracked = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_m = p_tracked_m;
  Eigen::Vector3d miss_m = p_tracked_m - trackedPosition_m(p_m);
  Eigen::Vector3d best_m = p_m;
  double least_m = miss_m.norm();
  for (int i = 0; i < kMostSteps && least_m > kNear * range_m; ++i) {
    Eigen::Vector3d step_m = true_by_tracked * miss_m;
    const double length_m = step_m.norm();
    if (!(length_m > 0.0) || !std::isfinite(length_m)) break;
    if (length_m > kLongestStep * range_m) step_m *= kLongestStep * range_m / length_m;
    p_m += step_m;
    const Eigen::Vector3d new_miss_m = p_tracked_m - trackedPosition_m(p_m);
    const Eigen::Vector3d moved_m = true_by_tracked * (miss_m - new_miss_m);
    const double scale = step_m.dot(moved_m);
    if (std::abs(scale) > 1e-3 * step_m.squaredNorm())
      true_by_tracked += (step_m - moved_m) * (step_m.transpose() * true_by_tracked) / scale;
    miss_m = new_miss_m;
    if (miss_m.norm() < least_m) {
      least_m = miss_m.norm();
      best_m = p_m;
    }
  }
  return best_m;
}

}  // namespace fieldtrue
