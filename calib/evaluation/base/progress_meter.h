#pragma once

#include <algorithm>
#include <functional>
#include <mutex>

#include "calib/core/error.h"
#include "calib/core/run_control.h"

namespace fieldtrue::evaluation {

/// The same control, telling its progress as a part of the whole.
inline RunControl partOf(const RunControl& control, double from, double to) {
  RunControl part = control;
  part.progress = [&control, from, to](double fraction) { control.progress(from + (to - from) * fraction); };
  return part;
}

/// What a comparison ends with once it is asked to stop.
inline tl::unexpected<Error> comparisonStopped() {
  return fail(ErrorCode::kCancelled, "The comparison was stopped on request");
}

/// Adds up the shares of tasks that end on any thread, so that the fraction told never falls.
class ProgressMeter {
 public:
  /// @param tell is called one thread at a time
  /// @param from, to part of the whole that this meter covers
  ProgressMeter(const std::function<void(double)>& tell, double from, double to, double total)
      : tell_(tell), from_(from), to_(to), total_(total) {}

  void add(double share) {
    const std::lock_guard lock(mutex_);
    done_ += share;
    tell_(from_ + (to_ - from_) * std::min(1.0, total_ > 0.0 ? done_ / total_ : 1.0));
  }

 private:
  const std::function<void(double)>& tell_;
  double from_;
  double to_;
  double total_;
  double done_ = 0.0;
  std::mutex mutex_;
};

}  // namespace fieldtrue::evaluation
