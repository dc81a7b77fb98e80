#include "acquisition/sampling/stillness.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "acquisition/sampling/node_sampler.h"
#include "acquisition/sampling/shift_test.h"

namespace fieldtrue::acquisition {

namespace {

constexpr std::size_t kMinSamples = 6;
constexpr double kLongestStep_s = 1.0;  ///< From reading to reading: of a slower tracker rest is not seen.
constexpr double kStillSigmas = 4.0;
/// A window counts as full when its samples span this share of it.
constexpr double kFullWindow = 0.8;
/// Longest silence of good samples, in windows, before there is no signal.
constexpr double kSilence = 0.4;

std::vector<Eigen::Vector3d> goodPositions(const std::vector<Sample>& samples) {
  std::vector<Eigen::Vector3d> positions;
  for (const Sample& sample : samples) {
    if (isGood(sample)) positions.push_back(sample.tracker_from_sensor.position_m);
  }
  return positions;
}

double spreadOf(const std::vector<Eigen::Vector3d>& positions) {
  if (positions.size() < 2) return 0.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& position : positions) mean += position;
  mean /= static_cast<double>(positions.size());
  double sum = 0.0;
  for (const Eigen::Vector3d& position : positions) sum += (position - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(positions.size() - 1));
}

double driftBetweenHalves(const std::vector<Eigen::Vector3d>& positions) {
  const std::size_t half = positions.size() / 2;
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < half; ++i) drift += positions[positions.size() - 1 - i] - positions[i];
  return drift.norm() / static_cast<double>(half);
}

std::string movingReason(double speed_m_s) {
  char text[64];
  std::snprintf(text, sizeof text, "hold still: moving %.*f mm/s", speed_m_s < 0.002 ? 1 : 0, speed_m_s * 1e3);
  return text;
}

}  // namespace

bool isGood(const Sample& sample) {
  const Pose& pose = sample.tracker_from_sensor;
  return sample.status.empty() && pose.position_m.allFinite() && pose.orientation.coeffs().allFinite() &&
         pose.orientation.norm() > 1e-6 && !isMissingMark(pose.position_m.cwiseAbs().maxCoeff());
}

StillnessDetector::StillnessDetector(double window_s, double floor_m) : window_s_(window_s), floor_m_(floor_m) {
  FT_CHECK(window_s > 0.0 && floor_m > 0.0);
}

void StillnessDetector::add(const Sample& sample) {
  judgement_.reset();
  if (!samples_.empty() && sample.time_s < samples_.back().time_s) clear();
  step_s_ = samples_.empty() ? 0.0 : sample.time_s - samples_.back().time_s;
  samples_.push_back(sample);
  samples_.erase(samples_.begin(), samples_.end() - static_cast<std::ptrdiff_t>(judgedSamples()));
}

std::size_t StillnessDetector::judgedSamples() const {
  const auto step_s = [this](std::size_t n) {
    return samples_[samples_.size() - n].time_s - samples_[samples_.size() - n - 1].time_s;
  };
  const auto in_window = std::find_if(samples_.begin(), samples_.end(), [this](const Sample& sample) {
    return sample.time_s >= samples_.back().time_s - window_s_;
  });
  auto n = static_cast<std::size_t>(samples_.end() - in_window);
  // A slow tracker fills no window; a fast one that was interrupted is none.
  const double slow_step_s = window_s_ / kMinSamples;
  const auto is_slow = [&](double step) { return step >= slow_step_s && step <= kLongestStep_s; };
  while (n < std::min(kMinSamples, samples_.size()) && is_slow(step_s(1)) && is_slow(step_s(n))) ++n;
  return n;
}

void StillnessDetector::clear() {
  judgement_.reset();
  samples_.clear();
}

StillnessDetector::Judgement StillnessDetector::judge() const {
  Judgement result;
  if (samples_.empty()) return result;
  const auto newest_good = std::find_if(samples_.rbegin(), samples_.rend(), isGood);
  const double newest_s = samples_.back().time_s;
  if (newest_good == samples_.rend() || newest_s - newest_good->time_s > kSilence * window_s_) {
    const std::string& status = samples_.back().status;
    result.rest = Rest::kUntold;
    result.reason = "no signal: the tracker reports " + (status.empty() ? "no position" : "error " + status);
    return result;
  }
  const std::vector<Eigen::Vector3d> positions = goodPositions(samples_);
  const double span_s = newest_s - samples_.front().time_s;
  result.spread_m = spreadOf(positions);
  if (positions.size() < kMinSamples || span_s < kFullWindow * window_s_) {
    result.rest = step_s_ > kLongestStep_s ? Rest::kUntold : Rest::kWatching;
    result.reason = "hold still: watching the sensor";
    return result;
  }
  // The means of the two halves lie half the window apart.
  result.speed_m_s = driftBetweenHalves(positions) / (0.5 * span_s);
  const int block = std::max(1, static_cast<int>(positions.size() / 4));
  const bool moves =
      steadyRun(positions, floor_m_).moved() || largestShift(positions, block, floor_m_, kStillSigmas).moved();
  result.rest = moves ? Rest::kMoving : Rest::kResting;
  result.reason = moves ? movingReason(result.speed_m_s) : "still";
  return result;
}

const StillnessDetector::Judgement& StillnessDetector::judgement() const {
  if (!judgement_) judgement_ = judge();
  return *judgement_;
}

Rest StillnessDetector::rest() const { return judgement().rest; }
double StillnessDetector::speed_m_s() const { return judgement().speed_m_s; }
double StillnessDetector::spread_m() const { return judgement().spread_m; }
std::string StillnessDetector::reason() const { return judgement().reason; }

}  // namespace fieldtrue::acquisition
