#include "acquisition/sampling/take_sampler.h"

#include <algorithm>

#include "calib/core/number_text.h"

namespace fieldtrue::acquisition {

namespace {

/// A tracker's readings are no farther apart than so many times what they were.
constexpr double kSlowSteps = 4.0;

}  // namespace

void TakeSampler::start(const std::vector<int>& sensors) {
  cancel();
  runs_ = true;
  for (const int sensor : sensors) {
    of_sensors_.push_back({sensor, NodeSampler(options_)});
    of_sensors_.back().sampler.start();
  }
}

void TakeSampler::cancel() {
  runs_ = false;
  of_sensors_.clear();
  newest_s_.reset();
  longest_step_s_ = 0.0;
}

TakeState TakeSampler::add(const Sample& sample) {
  if (state() != TakeState::kCollecting) return state();
  beginAgainAfterGap(sample.time_s);
  for (OfSensor& one : of_sensors_) {
    if (one.sensor != sample.sensor) continue;
    const int restarts = one.sampler.restarts();
    if (one.sampler.state() == TakeState::kDone)
      one.sampler.watch(sample);
    else
      one.sampler.add(sample);
    if (one.sampler.restarts() == restarts) continue;
    for (OfSensor& other : of_sensors_)
      if (other.sensor != sample.sensor) other.sampler.startOver(one.sampler.lastMotion());
  }
  return passTime(sample.time_s);
}

TakeState TakeSampler::passOver(const Sample& sample) {
  if (state() != TakeState::kCollecting) return state();
  beginAgainAfterGap(sample.time_s);
  for (OfSensor& one : of_sensors_)
    if (one.sensor == sample.sensor) one.sampler.passOver(sample);
  return passTime(sample.time_s);
}

TakeState TakeSampler::passTime(double time_s) {
  if (state() != TakeState::kCollecting) return state();
  for (OfSensor& one : of_sensors_) one.sampler.passTime(time_s);
  return state();
}

void TakeSampler::beginAgainAfterGap(double time_s) {
  const double step_s = newest_s_ ? time_s - *newest_s_ : 0.0;
  newest_s_ = time_s;
  const bool is_gap = step_s >= std::max(kSilent_s, kSlowSteps * longest_step_s_);
  if (!is_gap || longest_step_s_ == 0.0) {
    longest_step_s_ = std::max(longest_step_s_, step_s);
    return;
  }
  const std::string why = "no reading came for " + fixedText(step_s, 0) + " s";
  for (OfSensor& one : of_sensors_)
    if (one.sampler.collected() > 0) one.sampler.beginAgain(why);
}

bool TakeSampler::canKeep() const {
  return std::all_of(of_sensors_.begin(), of_sensors_.end(), [](const OfSensor& one) {
    return one.sampler.state() == TakeState::kDone || one.sampler.canKeep();
  });
}

void TakeSampler::keep() {
  for (OfSensor& one : of_sensors_)
    if (one.sampler.state() == TakeState::kHeld) one.sampler.keep();
}

void TakeSampler::waitLonger() {
  newest_s_.reset();
  for (OfSensor& one : of_sensors_)
    if (one.sampler.state() == TakeState::kHeld) one.sampler.waitLonger();
}

TakeState TakeSampler::state() const {
  if (!runs_) return TakeState::kIdle;
  const auto is = [](TakeState state) { return [state](const OfSensor& one) { return one.sampler.state() == state; }; };
  if (std::any_of(of_sensors_.begin(), of_sensors_.end(), is(TakeState::kFailed))) return TakeState::kFailed;
  if (std::any_of(of_sensors_.begin(), of_sensors_.end(), is(TakeState::kHeld))) return TakeState::kHeld;
  const bool done = !of_sensors_.empty() && std::all_of(of_sensors_.begin(), of_sensors_.end(), is(TakeState::kDone));
  return done ? TakeState::kDone : TakeState::kCollecting;
}

const NodeSampler* TakeSampler::of(int sensor) const {
  for (const OfSensor& one : of_sensors_)
    if (one.sensor == sensor) return &one.sampler;
  return nullptr;
}

const NodeSampler& TakeSampler::farthestBehind() const {
  const auto share = [](const OfSensor& one) {
    return static_cast<double>(one.sampler.collected()) / std::max(one.sampler.wanted(), 1);
  };
  const auto last = std::min_element(of_sensors_.begin(), of_sensors_.end(),
                                     [&](const OfSensor& a, const OfSensor& b) { return share(a) < share(b); });
  return last == of_sensors_.end() ? none_ : last->sampler;
}

std::string TakeSampler::told(const OfSensor& one, const std::string& reason) const {
  return (of_sensors_.size() > 1 ? "sensor " + std::to_string(one.sensor) + ": " : std::string()) + reason;
}

std::string TakeSampler::message() const {
  const TakeState now = state();
  if (now != TakeState::kFailed && now != TakeState::kHeld) return farthestBehind().message();
  std::string text;
  for (const OfSensor& one : of_sensors_) {
    if (one.sampler.state() != now) continue;
    text += (text.empty() ? "" : "; ") + told(one, one.sampler.message());
  }
  return text;
}

}  // namespace fieldtrue::acquisition
