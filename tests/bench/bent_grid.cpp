#include "tests/bench/bent_grid.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/core/pose.h"

namespace fieldtrue::bench {
namespace {

Eigen::Vector3d bend_m(const Eigen::Vector3d& p_m) {
  return 0.05 * Eigen::Vector3d(std::sin(2.0 * p_m.y()), std::cos(1.5 * p_m.z()), p_m.x() * p_m.y());
}

}  // namespace

correctors::FitData bentGrid(int n) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> noise_m(0.0, 0.002);
  correctors::FitData data;
  for (int i = 0; i < n * n * n; ++i) {
    const Eigen::Vector3d p_true_m = 2.0 / n * Eigen::Vector3d(i % n, i / n % n, i / (n * n));
    data.p_true_m.push_back(p_true_m);
    data.p_tracked_m.push_back(p_true_m + bend_m(p_true_m) +
                               Eigen::Vector3d(noise_m(generator), noise_m(generator), noise_m(generator)));
    data.node.push_back(i);
  }
  return data;
}

correctors::FitData straightGrid(const std::array<int, 3>& counts) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> noise_m(0.0, 0.002);
  correctors::FitData data;
  const double pitch_m = 2.0 / *std::max_element(counts.begin(), counts.end());
  for (int i = 0; i < counts[0]; ++i)
    for (int j = 0; j < counts[1]; ++j)
      for (int k = 0; k < counts[2]; ++k) {
        const Eigen::Vector3d p_m = pitch_m * Eigen::Vector3d(i, j, k);
        const Eigen::Vector3d noise(noise_m(generator), noise_m(generator), noise_m(generator));
        data.p_tracked_m.push_back(p_m);
        data.p_true_m.push_back(p_m + bend_m(p_m) + noise);
        data.q_true.emplace_back(Eigen::Quaterniond::Identity());
        data.q_tracked.push_back(rotationFromVector(bend_m(p_m) + noise));
        data.noise_m2.emplace_back(1e-6 * Eigen::Matrix3d::Identity());
        data.index.push_back({i, j, k});
        data.node.push_back(static_cast<int>(data.node.size()));
      }
  data.jig_sd_m = 0.002;
  return data;
}

std::vector<Eigen::Vector3d> pointsWithin(std::size_t count) {
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> uniform(0.05, 1.7);
  std::vector<Eigen::Vector3d> points_m(count);
  for (Eigen::Vector3d& p_m : points_m)
    p_m = Eigen::Vector3d(uniform(generator), uniform(generator), uniform(generator));
  return points_m;
}

}  // namespace fieldtrue::bench
