#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/pose.h"

namespace fieldtrue::testing {

/// A grid over 8 x 8 x 6 feet in a room bent smoothly as no physics would bend it, with noise and a jig of 5 mm.
inline CalibrationTable bentRoom(const std::array<int, 3>& counts = {9, 9, 7}) {
  CalibrationTable table;
  table.metadata.jig_tolerance_m = 0.005;
  std::uint32_t state = 1;
  const auto noise = [&state](double sd) {
    Eigen::Vector3d drawn = Eigen::Vector3d::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 12; ++i) drawn[axis] += (state = state * 1664525U + 1013904223U) / 4294967296.0;
      drawn[axis] -= 6.0;
    }
    return Eigen::Vector3d(sd * drawn);
  };
  for (int place = 0; place < counts[0] * counts[1] * counts[2]; ++place) {
    Node node;
    node.node = place;
    node.index = {place % counts[0], place / counts[0] % counts[1], place / (counts[0] * counts[1])};
    const auto share = [&](std::size_t axis) { return (*node.index)[axis] / (counts[axis] - 1.0); };
    const Eigen::Vector3d p_m = 0.3048 * Eigen::Vector3d(8 * share(0) - 4, 8 * share(1) - 4, 6 * share(2) + 1);
    const Eigen::Vector3d bent_m(0.03 * std::sin(1.5 * p_m.z() + p_m.x()), 0.05 * std::sin(1.1 * p_m.x() * p_m.y()),
                                 0.02 * p_m.squaredNorm() / 3.0);
    node.reference_from_sensor.position_m = p_m;
    node.tracker_from_sensor.position_m = p_m + bent_m + noise(0.005);
    node.tracker_from_sensor.orientation = rotationFromVector(bent_m + noise(0.002));
    node.covariance_m2 = Eigen::Matrix3d(1e-6 * p_m.squaredNorm() * Eigen::Matrix3d::Identity());
    node.sd_rot_rad = 0.002;
    node.n_used = 60;
    node.n_effective = 20.0;
    table.nodes.push_back(node);
  }
  return table;
}

/// Some of its places, drawn without putting back, in their order.
inline CalibrationTable bentRoom(std::size_t n_places, std::uint32_t seed) {
  const CalibrationTable whole = bentRoom();
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < whole.nodes.size(); ++i) order.push_back(i);
  for (std::size_t i = 0; i < n_places; ++i) {
    seed = seed * 1664525U + 1013904223U;
    std::swap(order[i], order[i + (seed >> 8U) % (order.size() - i)]);
  }
  order.resize(n_places);
  std::sort(order.begin(), order.end());
  CalibrationTable some;
  some.metadata = whole.metadata;
  for (const std::size_t place : order) some.nodes.push_back(whole.nodes[place]);
  return some;
}

}  // namespace fieldtrue::testing
