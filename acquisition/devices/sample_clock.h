#pragma once

#include <cstddef>
#include <map>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// Gives the readings of one steady stream their times, though they arrive in bunches: a second-order loop follows the
/// arrivals with the stream's own period.
class SampleClock {
 public:
  /// @param nominal_period_s from one reading to the next; the true one may differ by a factor of two
  explicit SampleClock(double nominal_period_s);
  /// @param arrival_s when the reading's bytes were read, never less than before
  /// @param later_in_bunch readings of this stream that were read with it and come after it
  /// @return time of the reading [s], always growing; starts anew after a gap
  double stamp(double arrival_s, std::size_t later_in_bunch = 0);
  double period_s() const { return period_s_; }

 private:
  double nominal_s_;
  double period_s_;
  double last_s_ = 0.0;
  bool started_ = false;
};

/// Gives readings the tracker's own clock's spacing and the computer's time: follows the least delayed arrivals, so
/// that a busy computer does not move them, and notices when the tracker's clock jumps.
class UnitClock {
 public:
  /// @param speed the tracker's seconds per second; other than 1 only for an emulated tracker
  explicit UnitClock(double speed = 1.0) : speed_(speed) {}
  /// @param arrival_s when the reading's bytes were read, never less than before
  /// @param unit_s the tracker's clock at the reading; the same for readings taken together
  /// @return time of the reading [s], never less than before but after a jump
  double stamp(double arrival_s, double unit_s);
  /// Whether the last reading's clock did not go on where the one before it was.
  bool jumped() const { return jumped_; }
  double jump_s() const { return jump_s_; }

 private:
  double speed_;
  double offset_s_ = 0.0;
  double last_unit_s_ = 0.0;
  double jump_s_ = 0.0;
  bool started_ = false;
  bool jumped_ = false;
};

/// Recognises readings that jump to the place mirrored through the transmitter, which no hand can reach between two
/// readings: the tracker has lost its hemisphere.
class HemisphereWatch {
 public:
  /// Marks the sample `flipped` while its stream is mirrored. Counts readings, because arrival times of a busy machine
  /// do not tell how long a hand had.
  void check(Sample& sample);

 private:
  struct Track {
    bool known = false;
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< With the mirroring undone.
    int readings_since = 0;
  };
  std::map<int, Track> tracks_;  ///< By sensor.
};

}  // namespace fieldtrue::acquisition
