#pragma once

#include <QString>

#include "acquisition/sampling/stand_watch.h"
#include "acquisition/sampling/stillness.h"
#include "acquisition/sampling/take_sampler.h"
#include "acquisition/sampling/time_limit.h"

namespace fieldtrue::acquisition {

/// The take that runs or is waited for: how the leading sensor stands, what is collected, and why the last one failed.
struct RunningTake {
  explicit RunningTake(const SamplerOptions& sampler_options) : options(sampler_options), sampler(sampler_options) {}

  bool collecting() const { return sampler.state() == TakeState::kCollecting; }
  bool held() const { return sampler.state() == TakeState::kHeld; }
  bool runs() const { return collecting() || held(); }
  bool isRefusedAt(std::optional<std::size_t> place) const { return refused_at && refused_at == place; }
  bool isWhereTaken() const { return stand.hasTaken() && !stand.left(); }
  /// @param sensors the leading one first
  /// @param is_away the sensor stands elsewhere, and the take was asked for all the same
  void start(const std::vector<int>& sensors, bool is_away);
  /// A reading of a sensor that takes part. Of a jig that moves none is a sample: they begin when it rests, again after
  /// motion has started the take over.
  /// @param is_judged stillness was judged anew with it
  TakeState add(const Sample& sample, bool is_judged);
  bool mayMove() const;  ///< The jig, by its leading sensor: it is not seen to rest, though that could be seen.
  void forgetFailure();
  void stayStopped(const std::optional<Sample>& live);  ///< None begins by itself before the jig has moved away.
  /// Follows how the sensor stands. @return whether stillness is to be judged anew with this sample
  bool watch(const Sample& sample, bool has_session);
  /// It has stood still for long enough, and not where it was taken last, for a take by itself.
  bool hasRested(bool reference_known) const;
  bool waitedInVain(const Sample& live);  ///< For a usable signal, as long as a take may last.

  SamplerOptions options;
  AtTimeLimit at_time_limit = AtTimeLimit::kUsual;
  TakeSampler sampler;
  StillnessDetector stillness;
  StandWatch stand;
  std::optional<std::size_t> refused_at;  ///< The place whose take was refused because the sensor stood elsewhere.
  bool taken_away = false;                ///< The running take was asked for although it had been refused.
  bool awaits_rest = false;               ///< The running take has not begun, or not again, for the jig moves.
  int times_again = 0;                    ///< The current place was taken again because its time was over.
  bool automatic = false;
  std::optional<double> looked_at_s;  ///< When stillness was last judged for automatic takes.
  bool stood_still = false;
  std::optional<double> waiting_since_s;  ///< Session time since which the current place waits for a usable signal.
  QString failure;                        ///< Why the last take failed; shown until the next action, or for a while.
  double failure_time_s = 0.0;
  bool not_stored = false;  ///< The last take failed for that: it is shown, and none begins by itself, until an action.
};

}  // namespace fieldtrue::acquisition
