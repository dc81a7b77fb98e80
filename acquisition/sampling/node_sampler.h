#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/sampling/take_length.h"
#include "calib/core/calibration_table.h"
#include "calib/core/statistics.h"

namespace fieldtrue::acquisition {

inline constexpr double kSilent_s = 2.0;  ///< Without a reading for so long a sensor is silent.

struct SamplerOptions {
  TakeLength length;
  double still_floor_m = 0.0005;   ///< Motion smaller than this is never called motion.
  double still_floor_rad = 0.005;  ///< Turning smaller than this is never called motion.
  double still_sigmas = 4.0;       ///< Motion larger than this many standard errors of the difference of the means is.
  /// Samples in a block, at least; at each block's end the means before and after are compared. Of a long take a block
  /// is a thirtieth.
  int block = 10;
  /// Without enough good samples by then, beyond the time that was asked for, the take fails with its reason; one whose
  /// mean is not known as well as was asked for ends with what it has, and says so.
  double time_limit_s = 30.0;
  bool holds_at_time_limit = false;  ///< Instead it is held there: keep(), waitLonger() or start() goes on.
  AveragingOptions averaging;
};

enum class TakeState {
  kIdle,
  kCollecting,
  kHeld,  ///< Its time is over before it has what was asked for, and what becomes of it is not said yet.
  kDone,
  kFailed
};

/// Collects the good samples of one sensor for a take of one place. Pure: samples in, state out; no clock, no thread.
///
/// A take that moved starts over by itself; the time limit counts from its very first sample, so that it never repeats
/// without end.
class NodeSampler {
 public:
  explicit NodeSampler(const SamplerOptions& options = {});
  void start();  ///< Begins a take, dropping what was collected.
  void cancel();
  TakeState add(const Sample& sample);
  /// One that is done looks on: motion starts it over, and nothing else of the sample counts.
  void watch(const Sample& sample);
  /// A reading of a jig that has not come to rest: it is no sample.
  TakeState passOver(const Sample& sample);
  /// Time goes on, also for a sensor that says nothing. @param time_s of the clock of the samples
  TakeState passTime(double time_s);
  bool canKeep() const { return state_ == TakeState::kHeld && can_keep_; }  ///< What it has can be averaged.
  void keep();        ///< A held one is done with what it has, and says in what it fell short.
  void waitLonger();  ///< A held one goes on, for as long again.
  /// What is collected counts no more, even where that was enough. @param motion what was seen: "moved 3 mm"
  void startOver(const std::string& motion);
  /// The same, for another reason than motion: that is no reason to suspect the take.
  void beginAgain(const std::string& why);
  TakeState state() const { return state_; }
  int collected() const { return collected_; }  ///< Good samples so far.
  int wanted() const { return wanted_; }        ///< Good samples; so far estimated where they are not counted.
  int restarts() const { return restarts_; }    ///< Times motion made it start over.
  const std::string& lastMotion() const { return last_motion_; }
  /// Why it restarted, failed or is held, what it waits for; in what it fell short where it is done all the same.
  const std::string& message() const { return message_; }
  const std::vector<Sample>& samples() const {
    return samples_;
  }  ///< Every sample since the last start over, bad ones too.
  /// What was collected before the last start over.
  const std::vector<Sample>& abandoned() const { return abandoned_; }
  const std::vector<Sample>& watched() const { return watched_; }  ///< Good samples since it was done.
  const std::optional<NodeStatistics>& statistics() const { return statistics_; }

 private:
  void look();
  int looked() const;  ///< Good samples in which motion is looked for.
  int blockNow() const;
  bool isComplete(bool is_due);
  bool isCompleteByTime();
  bool isCompleteByError();
  void timeOut();
  std::optional<std::string> motion(int block) const;
  void finish();
  double allowed_s() const;
  bool hasEnough() const;  ///< For a mean.
  bool isKnown() const;    ///< The mean, if not as well as was asked for.
  std::string shortfall() const;
  std::string timeLimitReason() const;

  SamplerOptions options_;
  TakeState state_ = TakeState::kIdle;
  int collected_ = 0;
  int wanted_ = 0;
  int next_look_ = 0;  ///< Good samples at which the next block ends.
  int restarts_ = 0;
  int bad_ = 0;          ///< Samples with an error status since start(), over all restarts.
  int passed_over_ = 0;  ///< Since start().
  std::string last_status_;
  std::string last_motion_;
  std::optional<double> first_time_s_;       ///< When its time began to run.
  bool can_keep_ = false;                    ///< As it was held.
  std::optional<std::string> moved_at_end_;  ///< Before it was held, and too late for a block of its own.
  int limits_ = 1;                           ///< Time limits that it was given.
  bool was_held_ = false;                    ///< Since the newest sample.
  double held_s_ = 0.0;                      ///< Of the time that its samples span.
  std::optional<double> newest_s_;           ///< Of its own samples.
  double now_s_ = 0.0;
  std::string message_;
  std::vector<Sample> samples_;
  std::vector<Sample> watched_;
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
