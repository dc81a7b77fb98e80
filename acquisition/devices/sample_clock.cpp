#include "acquisition/devices/sample_clock.h"

#include <algorithm>
#include <cmath>

#include "acquisition/protocols/fastrak_items.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

SampleClock::SampleClock(double nominal_period_s) : nominal_s_(nominal_period_s), period_s_(nominal_period_s) {
  FT_CHECK(nominal_period_s > 0.0);
}

double SampleClock::stamp(double arrival_s, std::size_t later_in_bunch) {
  constexpr double kTimeGain = 0.05;
  constexpr double kPeriodGain = 0.001;
  constexpr double kGap_s = 0.25;
  constexpr double kGapPeriods = 30.0;
  const double made_s = arrival_s - static_cast<double>(later_in_bunch) * period_s_;
  if (!started_) {
    started_ = true;
    return last_s_ = made_s;
  }
  const double predicted_s = last_s_ + period_s_;
  const double late_s = made_s - predicted_s;
  if (late_s > std::max(kGap_s, kGapPeriods * nominal_s_)) return last_s_ = made_s;
  period_s_ = std::clamp(period_s_ + kPeriodGain * late_s, 0.5 * nominal_s_, 2.0 * nominal_s_);
  return last_s_ = std::max(predicted_s + kTimeGain * late_s, last_s_ + 0.1 * nominal_s_);
}

void HemisphereWatch::check(Sample& sample) {
  constexpr double kNear_m = 0.05;
  constexpr int kForgetReadings = 60;
  constexpr double kSamePlace = 0.2;
  if (sample.sensor < 0 || sample.sensor >= static_cast<int>(tracks_.size())) return;
  Track& track = tracks_[static_cast<std::size_t>(sample.sensor)];
  track.known = track.known && ++track.readings_since <= kForgetReadings;
  if (!sample.status.empty()) return;
  const Eigen::Vector3d p = sample.tracker_from_sensor.position_m;
  const bool mirrored = track.known && p.norm() > kNear_m && (p + track.position_m).norm() < kSamePlace * p.norm();
  if (mirrored) sample.status = kStatusFlipped;
  track = {true, mirrored ? Eigen::Vector3d(-p) : p, 0};
}

}  // namespace fieldtrue::acquisition
