#pragma once

#include <cmath>

#include "acquisition/emulators/pose_source.h"

namespace fieldtrue::testing {

/// Sensors that stand where they are put, but for a tremble of a tenth of a millimetre that never says the same twice
/// in a row: as a real sensor does, and a tracker that repeats itself does not.
class ShakingSource : public acquisition::StandingSource {
 public:
  using StandingSource::StandingSource;
  std::vector<Sample> readNow(std::span<const int> sensors, double time_s) override {
    auto samples = StandingSource::readNow(sensors, time_s);
    ++readings_;
    for (Sample& sample : samples) {
      const double sign = readings_ % 2 == 0 ? 1.0 : -1.0;
      sample.tracker_from_sensor.position_m += Eigen::Vector3d::Constant(sign * kTremble_m);
    }
    return samples;
  }
  static constexpr double kTremble_m = 1e-4;

 private:
  int readings_ = 0;
};

}  // namespace fieldtrue::testing
