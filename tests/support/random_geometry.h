#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>

#include "calib/core/pose.h"

namespace fieldtrue::testing {

/// Seeded places and turns for tests that must hold anywhere.
class RandomGeometry {
 public:
  explicit RandomGeometry(unsigned seed) : generator_(seed) {}

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  double normal() { return std::normal_distribution<double>()(generator_); }

  Eigen::Vector3d direction() {
    const Eigen::Vector3d v(normal(), normal(), normal());
    return v.normalized();
  }

  /// In a cube around the origin [m].
  Eigen::Vector3d pointInCube_m(double half_edge_m) {
    const double x = between(-half_edge_m, half_edge_m);
    const double y = between(-half_edge_m, half_edge_m);
    const double z = between(-half_edge_m, half_edge_m);
    return {x, y, z};
  }

  Eigen::Quaterniond rotation() {
    const Eigen::Vector4d q(normal(), normal(), normal(), normal());
    return Eigen::Quaterniond(q.normalized());
  }

  Eigen::Matrix3d matrix() {
    Eigen::Matrix3d m;
    for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = normal();
    return m;
  }

  /// Distance uniform in a shell [m].
  Pose poseInShell(double nearest_m, double farthest_m) {
    const double range_m = between(nearest_m, farthest_m);
    return {range_m * direction(), rotation()};
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace fieldtrue::testing
