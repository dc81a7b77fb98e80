#pragma once

#include <array>

#include "calib/core/calibration_table.h"

namespace fieldtrue {

/// Gives the readings of one steady stream their times, though they arrive in bunches: a second-order loop follows the
/// arrivals with the stream's own period.
class SampleClock {
 public:
  /// @param nominal_period_s from one reading to the next; the true one may differ by a factor of two
  explicit SampleClock(double nominal_period_s);
  /// @param arrival_s when the reading's bytes were read, never less than before
  /// @return time of the reading [s], always growing; starts anew after a gap
  double stamp(double arrival_s);
  double period_s() const { return period_s_; }

 private:
  double nominal_s_;
  double period_s_;
  double last_s_ = 0.0;
  bool started_ = false;
};

/// Recognises readings that jump to the place mirrored through the transmitter, which no hand can reach between two
/// readings: the tracker has lost its hemisphere.
class HemisphereWatch {
 public:
  /// Marks the sample `flipped` while its stream is mirrored.
  void check(Sample& sample);

 private:
  struct Track {
    bool known = false;
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< With the mirroring undone.
    double time_s = 0.0;
  };
  std::array<Track, 4> tracks_;
};

}  // namespace fieldtrue
