#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// Mean of the good readings of one second of a sensor that rests.
struct SecondMean {
  double t_s = 0.0;  ///< Mean time of its readings.
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  double sd_m = 0.0;  ///< 3-D, of a single reading.
};

/// What is judged of a sensor's signal: its last readings, and where it has been since it rests.
struct SensorSignal {
  int sensor = 0;
  std::vector<Sample> recent;          ///< Oldest first, marked ones too.
  std::vector<SecondMean> seconds;     ///< Since it came to rest, at most an hour; empty while it moves.
  std::optional<double> rests_from_s;  ///< Readings from then on are of one stand.
};

/// Keeps what the signal of every sensor is judged by. Pure: samples in, values out; memory is bounded.
class SignalWindow {
 public:
  static constexpr double kRecent_s = 30.0;
  static constexpr std::size_t kMostSeconds = 3600;

  void add(const Sample& sample);
  void clear() { sensors_.clear(); }
  /// By sensor, ascending.
  std::vector<SensorSignal> sensors() const;

 private:
  struct Sensor {
    std::deque<Sample> recent;
    std::deque<SecondMean> seconds;
    std::vector<Sample> second;  ///< Good readings of the second that runs.
    double rests_from_s = 0.0;
  };
  static void closeSecond(Sensor& sensor);
  std::map<int, Sensor> sensors_;
};

}  // namespace fieldtrue::acquisition
