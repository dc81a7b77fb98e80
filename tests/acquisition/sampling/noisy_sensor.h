#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "calib/core/calibration_table.h"

namespace fieldtrue::testing {

inline constexpr double kNoisySensor_hz = 120.0;

/// First-order autoregressive noise on all three axes about a place, with changes of the place over time.
class NoisySensor {
 public:
  /// @param sd_m 3-D SD of one reading
  NoisySensor(double sd_m, double correlation, std::uint64_t seed)
      : axis_sd_m_(sd_m / std::sqrt(3.0)), correlation_(correlation), random_(seed) {
    for (double& x : state_) x = normal_(random_);
  }
  int sensor = 0;
  std::function<Eigen::Vector3d(int)> path_m = [](int) { return Eigen::Vector3d::Zero(); };
  Eigen::Vector3d place_m{0.8, -0.3, 0.2};

  Sample next() {
    Sample sample;
    sample.sensor = sensor;
    sample.time_s = n_ / kNoisySensor_hz;
    sample.tracker_from_sensor.position_m = place_m + axis_sd_m_ * state_ + path_m(n_);
    for (double& x : state_) x = correlation_ * x + std::sqrt(1 - correlation_ * correlation_) * normal_(random_);
    ++n_;
    return sample;
  }

 private:
  double axis_sd_m_;
  double correlation_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();
  int n_ = 0;
};

inline Eigen::Vector3d stepAt(int n, int when, double size_m) {
  return n < when ? Eigen::Vector3d::Zero() : Eigen::Vector3d(size_m / std::sqrt(3.0) * Eigen::Vector3d::Ones());
}

}  // namespace fieldtrue::testing
