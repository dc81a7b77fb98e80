#include "tests/blind/pose_solver.h"

#include <Eigen/SVD>
#include <cmath>

namespace blind {
namespace {

using Couplings = Eigen::Matrix<double, 9, 1>;

Couplings flat(const Matrix3d& m) { return Eigen::Map<const Couplings>(m.data()); }

// The strongest direction of S^T S lies along the line of sight; distance from its length.
SolvedPose firstGuess(const Matrix3d& couplings, const Vector3d& side_m) {
  const Eigen::JacobiSVD<Matrix3d> svd(couplings, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d u = svd.matrixV().col(0);
  if (u.dot(side_m) < 0) u = -u;
  const double r = std::cbrt(std::sqrt(6.0) / couplings.norm());
  const Matrix3d product = dipoleField(r * u) * couplings.transpose();
  const Eigen::JacobiSVD<Matrix3d> polar(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d flip = Matrix3d::Identity();
  flip(2, 2) = (polar.matrixU() * polar.matrixV().transpose()).determinant();
  return {r * u, Quaterniond(Matrix3d(polar.matrixU() * flip * polar.matrixV().transpose()))};
}

}  // namespace

Eigen::Matrix<double, 9, 6> couplingDerivative(const Vector3d& p_m, const Matrix3d& tracker_from_sensor) {
  const double r2 = p_m.squaredNorm();
  const double r5 = r2 * r2 * std::sqrt(r2);
  const Matrix3d field = dipoleField(p_m);
  Eigen::Matrix<double, 9, 6> derivative;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d e = Vector3d::Unit(axis);
    const Matrix3d outer = e * p_m.transpose() + p_m * e.transpose();
    const Matrix3d change =
        3 * (outer + p_m[axis] * Matrix3d::Identity()) / r5 - 15 * p_m[axis] / (r5 * r2) * p_m * p_m.transpose();
    derivative.col(axis) = flat(tracker_from_sensor.transpose() * change);
    derivative.col(3 + axis) = flat(-tracker_from_sensor.transpose() * skew(e) * field);
  }
  return derivative;
}

SolvedPose solvePose(const Matrix3d& couplings, const Vector3d& side_m) {
  SolvedPose pose = firstGuess(couplings, side_m);
  const auto missing = [&](const SolvedPose& at) {
    return flat(couplings - at.orientation.toRotationMatrix().transpose() * dipoleField(at.position_m));
  };
  double damping = 1e-6;
  Couplings residual = missing(pose);
  for (int iteration = 0; iteration < 60; ++iteration) {
    const auto derivative = couplingDerivative(pose.position_m, pose.orientation.toRotationMatrix());
    Eigen::Matrix<double, 6, 6> normal = derivative.transpose() * derivative;
    normal.diagonal() *= 1 + damping;
    const Eigen::Matrix<double, 6, 1> step = normal.ldlt().solve(derivative.transpose() * residual);
    const SolvedPose next{pose.position_m + step.head<3>(), turned(step.tail<3>(), pose.orientation)};
    const Couplings left = missing(next);
    const double size = step.head<3>().norm() / pose.position_m.norm() + step.tail<3>().norm();
    if (left.squaredNorm() <= residual.squaredNorm()) {
      pose = next;
      residual = left;
      damping = std::max(1e-12, damping * 0.1);
    } else {
      damping = std::min(1e6, damping * 10 + 1e-9);
    }
    if (size < 1e-12) break;
  }
  return pose;
}

}  // namespace blind
