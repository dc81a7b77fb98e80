#include "acquisition/sampling/take_sampler.h"

#include <algorithm>

namespace fieldtrue::acquisition {

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
}

TakeState TakeSampler::add(const Sample& sample) {
  if (state() != TakeState::kCollecting) return state();
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

TakeState TakeSampler::passTime(double time_s) {
  if (state() != TakeState::kCollecting) return state();
  for (OfSensor& one : of_sensors_) one.sampler.passTime(time_s);
  return state();
}

TakeState TakeSampler::state() const {
  if (!runs_) return TakeState::kIdle;
  const auto is = [](TakeState state) { return [state](const OfSensor& one) { return one.sampler.state() == state; }; };
  if (std::any_of(of_sensors_.begin(), of_sensors_.end(), is(TakeState::kFailed))) return TakeState::kFailed;
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
  if (state() != TakeState::kFailed) return farthestBehind().message();
  std::string text;
  for (const OfSensor& one : of_sensors_) {
    if (one.sampler.state() != TakeState::kFailed) continue;
    text += (text.empty() ? "" : "; ") + told(one, one.sampler.message());
  }
  return text;
}

}  // namespace fieldtrue::acquisition
