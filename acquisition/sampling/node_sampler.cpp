#include "acquisition/sampling/node_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "acquisition/sampling/shift_test.h"
#include "acquisition/sampling/stillness.h"
#include "calib/core/units.h"

namespace fieldtrue::acquisition {

namespace {

constexpr double kSuspiciousRejectedShare = 0.1;
constexpr double kSuspiciousSpreadRatio = 3.0;
constexpr std::size_t kMinNeighbours = 3;
constexpr double kMinSpread_m = 1e-4;  ///< An SD below this is never suspicious.

constexpr int kUsual = 60;  ///< Said to be wanted before anything is known.
constexpr int kFewestByTime = 10;
/// Fewer samples do not tell their correlation.
constexpr int kFewestByError = 30;
/// Independent samples below which their scatter is not known either, and a small error is chance.
constexpr double kFewestWorth = 20.0;
constexpr std::size_t kParts = 8;
constexpr double kMostWanted = 1e6;
/// Each block's end is compared with all samples: more of them would take longer than the samples of a long take do.
constexpr int kMostBlocks = 30;
/// Samples in a block where nothing follows: motion within the last whole block is looked for too.
constexpr int kLastBlock = 3;

double timeLimit_s(const SamplerOptions& options) {
  return options.time_limit_s + (options.length.until == TakeLength::Until::kSeconds ? options.length.amount : 0.0);
}

/// Of the mean position, 3-D, from the scatter of the means of equal parts of the take: it sees noise that lasts longer
/// than from one sample to the next.
double errorByParts_m(std::span<const Sample> samples) {
  std::vector<Eigen::Vector3d> positions_m;
  for (const Sample& sample : samples)
    if (isGood(sample)) positions_m.push_back(sample.tracker_from_sensor.position_m);
  const std::size_t of_part = positions_m.size() / kParts;
  if (of_part == 0) return HUGE_VAL;
  Eigen::Matrix<double, 3, kParts> means_m;
  for (std::size_t part = 0; part < kParts; ++part) {
    Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < of_part; ++i) sum_m += positions_m[part * of_part + i];
    means_m.col(static_cast<Eigen::Index>(part)) = sum_m / static_cast<double>(of_part);
  }
  return std::sqrt((means_m.colwise() - means_m.rowwise().mean()).squaredNorm() / (kParts * (kParts - 1)));
}

/// Of the mean position, 3-D: by the correlation of neighbours, or by parts where those say more.
double standardError_m(const NodeStatistics& statistics, std::span<const Sample> samples) {
  const double by_neighbours_m = std::sqrt(std::max(statistics.covariance_m2.trace(), 0.0) / statistics.n_effective);
  return std::max(by_neighbours_m, errorByParts_m(samples));
}

std::string format(const char* pattern, double value) {
  char text[96];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string millimetres(double value_m) { return format(value_m < 0.01 ? "%.1f mm" : "%.0f mm", value_m * 1e3); }

std::string times(int count) {
  if (count == 1) return "once";
  return count == 2 ? "twice" : std::to_string(count) + " times";
}

}  // namespace

NodeSampler::NodeSampler(const SamplerOptions& options) : options_(options) {
  FT_CHECK(checked(options_.length) && options_.block >= 1 && options_.time_limit_s > 0.0);
  cancel();
}

void NodeSampler::start() {
  cancel();
  state_ = TakeState::kCollecting;
}

void NodeSampler::cancel() {
  state_ = TakeState::kIdle;
  collected_ = restarts_ = bad_ = passed_over_ = 0;
  limits_ = 1;
  was_held_ = false;
  held_s_ = 0.0;
  next_look_ = options_.block;
  wanted_ = options_.length.until == TakeLength::Until::kSamples ? static_cast<int>(options_.length.amount) : kUsual;
  last_status_.clear();
  last_motion_.clear();
  first_time_s_.reset();
  newest_s_.reset();
  message_.clear();
  samples_.clear();
  watched_.clear();
  abandoned_.clear();
  statistics_.reset();
}

TakeState NodeSampler::add(const Sample& sample) {
  if (state_ != TakeState::kCollecting) return state_;
  if (!first_time_s_) first_time_s_ = sample.time_s;
  if (std::exchange(was_held_, false) && !samples_.empty()) held_s_ += sample.time_s - samples_.back().time_s;
  newest_s_ = sample.time_s;
  samples_.push_back(sample);
  if (isGood(sample)) {
    ++collected_;
  } else {
    ++bad_;
    last_status_ = sample.status;
  }
  if (isGood(sample)) look();
  return passTime(sample.time_s);
}

TakeState NodeSampler::passOver(const Sample& sample) {
  if (state_ != TakeState::kCollecting) return state_;
  newest_s_ = sample.time_s;
  ++passed_over_;
  return passTime(sample.time_s);
}

void NodeSampler::watch(const Sample& sample) {
  if (state_ != TakeState::kDone || !isGood(sample)) return;
  watched_.push_back(sample);
  if (looked() < next_look_) return;
  next_look_ = looked() + blockNow();
  if (const auto moved = motion(blockNow())) startOver(*moved);
}

TakeState NodeSampler::passTime(double time_s) {
  if (state_ != TakeState::kCollecting) return state_;
  now_s_ = time_s;
  if (!first_time_s_) first_time_s_ = time_s;
  if (time_s - *first_time_s_ >= timeLimit_s(options_)) timeOut();
  return state_;
}

void NodeSampler::look() {
  const bool is_due = collected_ >= next_look_;
  const bool complete = isComplete(is_due);
  if (!is_due && !complete) return;
  next_look_ = collected_ + blockNow();
  if (const auto moved = motion(blockNow())) {
    startOver(*moved);
  } else if (complete) {
    finish();
  }
}

int NodeSampler::looked() const { return collected_ + static_cast<int>(watched_.size()); }

int NodeSampler::blockNow() const { return std::max(options_.block, looked() / kMostBlocks); }

bool NodeSampler::isComplete(bool is_due) {
  if (options_.length.until == TakeLength::Until::kSeconds) return isCompleteByTime();
  if (options_.length.until == TakeLength::Until::kStandardError) return is_due && isCompleteByError();
  return collected_ >= wanted_;
}

bool NodeSampler::isCompleteByTime() {
  const double span_s = samples_.back().time_s - samples_.front().time_s - held_s_;
  if (span_s > 0.0) wanted_ = std::max(kFewestByTime, static_cast<int>(collected_ * options_.length.amount / span_s));
  return collected_ >= kFewestByTime && span_s >= options_.length.amount;
}

bool NodeSampler::isCompleteByError() {
  if (collected_ < kFewestByError) return false;
  const auto averaged = averageSamples(samples_, options_.averaging);
  if (!averaged) return false;
  const double ratio = standardError_m(*averaged, samples_) / options_.length.amount;
  const double times = std::max({1.0, ratio * ratio, kFewestWorth / averaged->n_effective});
  wanted_ = static_cast<int>(std::min(collected_ * times, kMostWanted));
  return ratio <= 1.0 && averaged->n_effective >= kFewestWorth;
}

void NodeSampler::timeOut() {
  moved_at_end_ = motion(std::max(kLastBlock, looked() / kMostBlocks));
  can_keep_ = hasEnough() && !moved_at_end_;
  message_ = shortfall();
  state_ = TakeState::kHeld;
  if (options_.holds_at_time_limit) return;
  if (isKnown() && can_keep_) return keep();
  state_ = TakeState::kFailed;
}

bool NodeSampler::hasEnough() const {
  const bool by_error = options_.length.until == TakeLength::Until::kStandardError;
  return collected_ >= (by_error ? kFewestByError : kFewestByTime);
}

void NodeSampler::keep() {
  const std::string text = message_;
  finish();
  if (state_ == TakeState::kDone) message_ = text;
}

void NodeSampler::waitLonger() {
  state_ = TakeState::kCollecting;
  first_time_s_.reset();
  was_held_ = true;
  ++limits_;
  message_.clear();
}

double NodeSampler::allowed_s() const { return limits_ * timeLimit_s(options_); }

bool NodeSampler::isKnown() const {
  return options_.length.until == TakeLength::Until::kStandardError && collected_ >= kFewestByError;
}

std::string NodeSampler::shortfall() const {
  const auto averaged = averageSamples(samples_, options_.averaging);
  if (!isKnown() || !can_keep_ || !averaged) return timeLimitReason();
  return "mean known to " + format("%.2g mm", 1e3 * standardError_m(*averaged, samples_)) + ", not to " +
         format("%g mm", 1e3 * options_.length.amount) + format(", after %g s", allowed_s());
}

std::optional<std::string> NodeSampler::motion(int block) const {
  std::vector<Eigen::Vector3d> positions_m, turns_rad;
  std::optional<Eigen::Quaterniond> first;
  for (const auto* part : {&samples_, &watched_}) {
    for (const Sample& sample : *part) {
      if (!isGood(sample)) continue;
      const Pose& pose = sample.tracker_from_sensor;
      const Eigen::Quaterniond orientation = pose.orientation.normalized();
      if (!first) first = orientation;
      positions_m.push_back(pose.position_m);
      turns_rad.push_back(rotationVector_rad(orientation * first->conjugate()));
    }
  }
  const Shift shift = largestShift(positions_m, block, options_.still_floor_m, options_.still_sigmas);
  if (shift.moved()) return "moved " + millimetres(shift.size);
  const Shift turn = largestShift(turns_rad, block, options_.still_floor_rad, options_.still_sigmas);
  if (turn.moved()) return "turned " + format("%.1f degrees", turn.size * kDegPerRad);
  return std::nullopt;
}

void NodeSampler::startOver(const std::string& motion) {
  ++restarts_;
  last_motion_ = motion;
  beginAgain(motion);
}

void NodeSampler::beginAgain(const std::string& why) {
  state_ = TakeState::kCollecting;
  statistics_.reset();
  message_ = "retaking: " + why;
  collected_ = 0;
  held_s_ = 0.0;
  next_look_ = options_.block;
  for (auto* part : {&samples_, &watched_}) {
    abandoned_.insert(abandoned_.end(), part->begin(), part->end());
    part->clear();
  }
}

void NodeSampler::finish() {
  const Result<NodeStatistics> averaged = averageSamples(samples_, options_.averaging);
  if (!averaged) {
    state_ = TakeState::kFailed;
    message_ = averaged.error().message;
    return;
  }
  statistics_ = *averaged;
  state_ = TakeState::kDone;
  message_.clear();
}

std::string NodeSampler::timeLimitReason() const {
  const double silent_s = now_s_ - newest_s_.value_or(*first_time_s_);
  if (silent_s >= kSilent_s)
    return format("silent for the last %.0f s: ", silent_s) + std::to_string(collected_) + " of " +
           std::to_string(wanted_) + " good samples";
  std::string text = format("not finished within %g s: ", allowed_s()) + std::to_string(collected_) + " of " +
                     std::to_string(wanted_) + " good samples";
  if (restarts_ > 0) text += ", started over " + times(restarts_) + " (" + last_motion_ + "); let the sensor rest";
  if (restarts_ == 0 && moved_at_end_) text += ", " + *moved_at_end_ + " at the end; let the sensor rest";
  if (restarts_ == 0 && passed_over_ > 0 && collected_ == 0) text += ", it never rested: let the sensor rest";
  if (bad_ > 0) {
    text += ", " + std::to_string(bad_) + " not usable";
    if (!last_status_.empty()) text += " (the tracker reports error " + last_status_ + ")";
  }
  return text;
}

std::string suspicionOf(const NodeStatistics& statistics, int restarts, const std::vector<NeighbourTake>& neighbours) {
  std::vector<std::string> reasons;
  const std::size_t rejected = statistics.rejections.size();
  const std::size_t total = statistics.n_used + rejected;
  if (static_cast<double>(rejected) > kSuspiciousRejectedShare * static_cast<double>(total)) {
    reasons.push_back(std::to_string(rejected) + " of " + std::to_string(total) + " samples left out");
  }
  if (restarts > 0) reasons.push_back("moved " + times(restarts) + " while sampling");
  const double spread_m = std::sqrt(std::max(statistics.covariance_m2.trace(), 0.0));
  const double range_m = statistics.mean.position_m.norm();
  if (neighbours.size() >= kMinNeighbours) {
    std::vector<double> expected_m;
    for (const NeighbourTake& neighbour : neighbours) {
      const double farther = neighbour.range_m > 0.0 ? std::max(range_m / neighbour.range_m, 1.0) : 1.0;
      expected_m.push_back(neighbour.spread_m * std::pow(farther, 4));
    }
    const double usual_m = median(expected_m);
    if (spread_m > kMinSpread_m && spread_m > kSuspiciousSpreadRatio * usual_m) {
      reasons.push_back("SD " + format("%.2g mm", spread_m * 1e3) + " where its neighbours lead one to expect " +
                        format("%.2g mm", usual_m * 1e3));
    }
  }
  std::string text;
  for (const std::string& reason : reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

}  // namespace fieldtrue::acquisition
