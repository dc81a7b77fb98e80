#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/statistics.h"

namespace fieldtrue {

struct SamplerOptions {
  int samples_per_node = 60;
  double still_floor_m = 0.0005;   ///< Motion smaller than this is never called motion.
  double still_floor_rad = 0.005;  ///< Turning smaller than this is never called motion.
  double still_sigmas = 4.0;       ///< Motion larger than this many standard errors of the difference of the means is.
  int block = 10;                  ///< Samples in a block; at each block's end the means before and after are compared.
  double time_limit_s = 30.0;      ///< Without enough good samples by then the take fails with its reason.
  AveragingOptions averaging;
};

/// Whether a sample may enter an average: no error status, and finite numbers.
bool isGood(const Sample& sample);

/// Watches the stream of one sensor and says whether it stands still, with the reason in words.
class StillnessDetector {
 public:
  /// @param window_s how much of the stream is judged, in the samples' own time
  /// @param floor_m drift over the window up to this is never motion
  explicit StillnessDetector(double window_s = 0.5, double floor_m = 0.0005);
  void add(const Sample& sample);
  void clear();
  bool still() const;
  double speed_m_s() const;    ///< Drift of the mean over the window.
  double spread_m() const;     ///< 3-D SD within the window.
  std::string reason() const;  ///< "still", "hold still: moving 4 mm/s", "no signal: ..."

 private:
  struct Judgement {
    bool still = false;
    double speed_m_s = 0.0;
    double spread_m = 0.0;
    std::string reason = "waiting for the tracker";
  };
  const Judgement& judgement() const;
  Judgement judge() const;

  double window_s_;
  double floor_m_;
  std::vector<Sample> samples_;
  mutable std::optional<Judgement> judgement_;  ///< Of samples_, kept until the next sample.
};

enum class TakeState { kIdle, kCollecting, kDone, kFailed };

/// Collects the good samples of one take of one place. Pure: samples in, state out; no clock, no thread.
///
/// A take that moved starts over by itself; the time limit counts from its very first sample, so that it never repeats
/// without end.
class NodeSampler {
 public:
  explicit NodeSampler(SamplerOptions options = {});
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
std::string suspicionOf(const NodeStatistics& statistics, int restarts, std::vector<NeighbourTake> neighbours = {});

}  // namespace fieldtrue
