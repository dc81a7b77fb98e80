#include "acquisition/devices/sample_clock.h"

#include <algorithm>
#include <cmath>

#include "acquisition/protocols/sample_status.h"
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

double UnitClock::stamp(double arrival_s, double unit_s) {
  constexpr double kEarly_s = 0.25;  // Nothing arrives before it was made; more is another clock.
  constexpr double kLate_s = 5.0;    // A computer may be busy for so long.
  constexpr double kLateGain = 0.001;
  constexpr double kMostLate_s =
      0.02;                           // So the clock follows 0.5 % of drift at 240 Hz, and a busy second moves it 5 ms.
  constexpr double kMostShare = 0.5;  // Of a step between two readings, by which earlier arrivals pull them back.
  const double step_s = unit_s - last_unit_s_;
  const double late_s = arrival_s - unit_s - offset_s_;
  jumped_ = started_ && (step_s < 0.0 || late_s < -kEarly_s * speed_ || late_s > kLate_s * speed_);
  if (!started_ || jumped_) {
    jump_s_ = started_ ? -late_s : 0.0;
    offset_s_ = arrival_s - unit_s;
    started_ = true;
  } else if (step_s > 0.0) {
    offset_s_ += late_s > 0.0 ? kLateGain * std::min(late_s, kMostLate_s) : std::max(late_s, -kMostShare * step_s);
  }
  last_unit_s_ = unit_s;
  return unit_s + offset_s_;
}

void HemisphereWatch::check(Sample& sample) {
  constexpr double kNear_m = 0.05;
  constexpr int kForgetReadings = 60;
  constexpr double kSamePlace = 0.2;
  Track& track = tracks_[sample.sensor];
  track.known = track.known && ++track.readings_since <= kForgetReadings;
  if (!sample.status.empty()) return;
  const Eigen::Vector3d p = sample.tracker_from_sensor.position_m;
  const bool mirrored = track.known && p.norm() > kNear_m && (p + track.position_m).norm() < kSamePlace * p.norm();
  if (mirrored) sample.status = kStatusFlipped;
  track = {true, mirrored ? Eigen::Vector3d(-p) : p, 0};
}

}  // namespace fieldtrue::acquisition
