#pragma once

#include <QElapsedTimer>
#include <memory>
#include <utility>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// A tracker's time as its line tells it: the computer's monotonic clock, faster for an emulated tracker; or a clock
/// that is set by hand, which passes an hour as fast as its readings can be read, however busy the computer is.
class TrackerClock {
 public:
  /// @param speed the tracker's seconds per second, above 0
  TrackerClock(double speed = 1.0) : speed_(speed) { FT_CHECK(speed_ > 0.0); }
  /// @param set_s the time it tells [s]; whoever holds it may only move it forward, in the thread that reads it
  explicit TrackerClock(std::shared_ptr<const double> set_s) : set_s_(std::move(set_s)) { FT_CHECK(set_s_ != nullptr); }

  double speed() const { return speed_; }
  /// Runs from now; goes on where it is if it runs already.
  void start() {
    if (!running_.isValid()) running_.start();
  }
  /// Zero until it is started.
  double now_s() const {
    if (!running_.isValid()) return 0.0;
    return set_s_ ? *set_s_ : static_cast<double>(running_.nsecsElapsed()) * 1e-9 * speed_;
  }

 private:
  double speed_ = 1.0;
  std::shared_ptr<const double> set_s_;
  QElapsedTimer running_;
};

}  // namespace fieldtrue::acquisition
