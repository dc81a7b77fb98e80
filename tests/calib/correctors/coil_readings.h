#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cmath>

#include "calib/core/pose.h"
#include "calib/correctors/base/sensor_coils.h"

namespace fieldtrue::testing {

/// Gains within two per cent of each other and coils half a degree from square.
inline const correctors::CoilStrain kUnequalCoils =
    (correctors::CoilStrain() << 0.012, -0.008, 0.004, 0.003, -0.006, 0.005).finished();

inline Eigen::Matrix3d strainMatrix(const correctors::CoilStrain& e) {
  Eigen::Matrix3d strain;
  strain << e[0], e[3], e[4], e[3], e[1], e[5], e[4], e[5], e[2];
  return strain;
}

inline Eigen::Matrix3d dipoleMatrix(const Eigen::Vector3d& p_m) {
  const double r = p_m.norm();
  const Eigen::Vector3d n = p_m / r;
  return (3.0 * n * n.transpose() - Eigen::Matrix3d::Identity()) / (r * r * r);
}

/// What a tracker reports of a sensor with such coils, written out: the nine signals M = (1 + E) R^T K, K the dipole's
/// matrix (3 n n^T - 1) / r^3; of M^T M the trace tells the range, and the axis of the largest eigenvalue the
/// direction; the orientation is the rotation nearest to M K^-1, with K where the sensor was found to be.
inline Pose readBy(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q, const correctors::CoilStrain& strain) {
  const Eigen::Matrix3d measured =
      (Eigen::Matrix3d::Identity() + strainMatrix(strain)) * q.toRotationMatrix().transpose() * dipoleMatrix(p_m);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> power(measured.transpose() * measured);
  const Eigen::Vector3d axis = power.eigenvectors().col(2);
  Pose read;
  read.position_m = std::pow(6.0 / power.eigenvalues().sum(), 1.0 / 6.0) * (axis.dot(p_m) < 0.0 ? -1.0 : 1.0) * axis;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(measured * dipoleMatrix(read.position_m).inverse(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  read.orientation =
      Eigen::Quaterniond(Eigen::Matrix3d((svd.matrixU() * svd.matrixV().transpose()).transpose())).normalized();
  return read;
}

}  // namespace fieldtrue::testing
