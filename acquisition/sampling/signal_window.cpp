#include "acquisition/sampling/signal_window.h"

#include <algorithm>
#include <cmath>

#include "acquisition/sampling/stillness.h"

namespace fieldtrue::acquisition {

namespace {

/// Means of two seconds farther apart than this, and than three SDs of a reading, are not of one stand: no tracker
/// drifts so fast.
constexpr double kMoved_m = 0.003;
constexpr double kMovedSds = 3.0;
/// After so long without a reading it may have been anywhere.
constexpr double kLongestGap_s = 2.5;
constexpr std::size_t kFewest = 5;

SecondMean meanOf(const std::vector<Sample>& samples) {
  SecondMean mean;
  const auto n = static_cast<double>(samples.size());
  for (const Sample& sample : samples) {
    mean.t_s += sample.time_s / n;
    mean.mean_m += sample.tracker_from_sensor.position_m / n;
  }
  double squares = 0.0;
  for (const Sample& sample : samples) squares += (sample.tracker_from_sensor.position_m - mean.mean_m).squaredNorm();
  mean.sd_m = std::sqrt(squares / (n - 1.0));
  return mean;
}

bool isOneStand(const SecondMean& before, const SecondMean& after) {
  const double limit_m = kMoved_m + kMovedSds * std::min(before.sd_m, after.sd_m);
  return after.t_s - before.t_s < kLongestGap_s && (after.mean_m - before.mean_m).norm() < limit_m;
}

}  // namespace

void SignalWindow::closeSecond(Sensor& sensor) {
  if (sensor.second.size() >= kFewest) {
    const SecondMean mean = meanOf(sensor.second);
    if (sensor.seconds.empty() || !isOneStand(sensor.seconds.back(), mean)) {
      sensor.seconds.clear();
      sensor.rests_from_s = sensor.second.front().time_s;
    }
    sensor.seconds.push_back(mean);
    if (sensor.seconds.size() > kMostSeconds) sensor.seconds.pop_front();
  }
  sensor.second.clear();
}

void SignalWindow::add(const Sample& sample) {
  Sensor& sensor = sensors_[sample.sensor];
  // A tracker that is connected again may begin its clock anew.
  if (!sensor.recent.empty() && sample.time_s < sensor.recent.back().time_s) sensor = Sensor();
  sensor.recent.push_back(sample);
  while (sensor.recent.front().time_s < sample.time_s - kRecent_s) sensor.recent.pop_front();
  if (!sensor.second.empty() && std::floor(sample.time_s) != std::floor(sensor.second.front().time_s))
    closeSecond(sensor);
  if (isGood(sample)) sensor.second.push_back(sample);
}

std::vector<SensorSignal> SignalWindow::sensors() const {
  std::vector<SensorSignal> of_sensors;
  for (const auto& [number, sensor] : sensors_) {
    SensorSignal signal;
    signal.sensor = number;
    signal.recent.assign(sensor.recent.begin(), sensor.recent.end());
    // Alone, a second may be one of a hand on its way.
    if (sensor.seconds.size() >= 2) {
      signal.seconds.assign(sensor.seconds.begin(), sensor.seconds.end());
      signal.rests_from_s = sensor.rests_from_s;
    }
    of_sensors.push_back(std::move(signal));
  }
  return of_sensors;
}

}  // namespace fieldtrue::acquisition
