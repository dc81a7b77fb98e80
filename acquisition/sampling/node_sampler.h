#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/statistics.h"

namespace fieldtrue::acquisition {

struct SamplerOptions {
  int samples_per_node = 60;
  double still_floor_m = 0.0005;   ///< Motion smaller than this is never called motion.
  double still_floor_rad = 0.005;  ///< Turning smaller than this is never called motion.
  double still_sigmas = 4.0;       ///< Motion larger than this many standard errors of the difference of the means is.
  int block = 10;                  ///< Samples in a block; at each block's end the means before and after are compared.
  double time_limit_s = 30.0;      ///< Without enough good samples by then the take fails with its reason.
  AveragingOptions averaging;
};

enum class TakeState { kIdle, kCollecting, kDone, kFailed };

/// Collects the good samples of one take of one place. Pure: samples in, state out; no clock, no thread.
///
/// A take that moved starts over by itself; the time limit counts from its very first sample, so that it never repeats
/// without end.
class NodeSampler {
 public:
  explicit NodeSampler(const SamplerOptions& options = {});
  void start();  ///< Begins a take, dropping what was collected.
  void cancel();
  TakeState add(const Sample& sample);
  TakeState state() const { return state_; }
  int collected() const { return collected_; }  ///< Good samples so far.
  int wanted() const { return options_.samples_per_node; }
  int restarts() const { return restarts_; }               ///< Times motion made it start over.
  const std::string& message() const { return message_; }  ///< Why it restarted or failed, what it waits for.
  const std::vector<Sample>& samples() const {
    return samples_;
  }  ///< Every sample since the last start over, bad ones too.
  /// What was collected before the last start over.
  const std::vector<Sample>& abandoned() const { return abandoned_; }
  const std::optional<NodeStatistics>& statistics() const { return statistics_; }

 private:
  std::optional<std::string> motion() const;
  void startOver(const std::string& motion);
  void finish();
  std::string timeLimitReason() const;

  SamplerOptions options_;
  TakeState state_ = TakeState::kIdle;
  int collected_ = 0;
  int restarts_ = 0;
  int bad_ = 0;  ///< Samples with an error status since start(), over all restarts.
  std::string last_status_;
  std::string last_motion_;
  std::optional<double> first_time_s_;
  std::string message_;
  std::vector<Sample> samples_;
  std::vector<Sample> abandoned_;
  std::optional<NodeStatistics> statistics_;
};

/// A finished take nearby, to compare a new one with.
struct NeighbourTake {
  double spread_m = 0.0;  ///< 3-D SD of a single sample.
  double range_m = 0.0;   ///< Distance from the transmitter.
};

/// Why a finished take should be looked at, in words; empty when it looks well. Suspicious are more than 10 % of the
/// samples left out, motion that made it start over, and an SD more than 3 times what the neighbours lead one to expect
/// (their SD, raised with the fourth power of the range when the new place is farther out).
/// @param neighbours the nearest finished takes; fewer than 3 are not compared
std::string suspicionOf(const NodeStatistics& statistics, int restarts,
                        const std::vector<NeighbourTake>& neighbours = {});

}  // namespace fieldtrue::acquisition
