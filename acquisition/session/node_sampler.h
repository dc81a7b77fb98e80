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
  double still_sigmas = 4.0;       ///< Motion larger than this many standard errors of a block mean is.
  int block = 10;                  ///< Samples in a block whose mean is compared with the first block's.
  double time_limit_s = 30.0;      ///< Without enough good samples by then the take fails with its reason.
  AveragingOptions averaging;
};

/// Watches the stream of one sensor and says whether it stands still, with the reason in words.
class StillnessDetector {
 public:
  explicit StillnessDetector(double window_s = 0.5, double floor_m = 0.0005);
  void add(const Sample& sample);
  void clear();
  bool still() const;
  double speed_m_s() const;        ///< Drift of the mean over the window.
  double spread_m() const;         ///< 3-D SD within the window.
  std::string reason() const;      ///< "still", "hold still: moving 4 mm/s", "no signal: ..." 

 private:
  double window_s_;
  double floor_m_;
  std::vector<Sample> samples_;
};

enum class TakeState { kIdle, kCollecting, kDone, kFailed };

/// Collects the good samples of one take of one place. Pure: samples in, state out; no clock, no thread.
class NodeSampler {
 public:
  explicit NodeSampler(SamplerOptions options = {});
  void start();   ///< Begins a take, dropping what was collected.
  void cancel();
  TakeState add(const Sample& sample);
  TakeState state() const { return state_; }
  int collected() const;        ///< Good samples so far.
  int wanted() const { return options_.samples_per_node; }
  int restarts() const { return restarts_; }  ///< Times motion made it start over.
  const std::string& message() const { return message_; }  ///< Why it restarted or failed, what it waits for.
  const std::vector<Sample>& samples() const { return samples_; }  ///< Every sample of the take, bad ones too.
  const std::optional<NodeStatistics>& statistics() const { return statistics_; }

 private:
  SamplerOptions options_;
  TakeState state_ = TakeState::kIdle;
  int restarts_ = 0;
  std::string message_;
  std::vector<Sample> samples_;
  std::optional<NodeStatistics> statistics_;
};

}  // namespace fieldtrue
