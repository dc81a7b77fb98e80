#pragma once

#include <deque>
#include <optional>

#include "acquisition/sampling/node_sampler.h"

namespace fieldtrue::acquisition {

/// Follows where the sensor rests, so that automatic takes never take the same stand twice.
///
/// A stand is left when the mean of a few readings is farther from it than the leave distance, or turned by more than
/// 20 degrees. All times are the samples' own.
class StandWatch {
 public:
  /// @param leave_distance_m how far the sensor must go for the stand to count as left
  void setLeaveDistance(double leave_distance_m);
  /// The stand that was just taken: it must be left before the next automatic take.
  void setTaken(const Pose& tracker_from_sensor);
  /// The same of a stand whose take was stopped. @param tracker_from_sensor none = where it is read next
  void setStopped(const std::optional<Pose>& tracker_from_sensor);
  /// No stand is taken; the next rest counts as one the sensor was found at.
  void forget();
  /// @param still what the StillnessDetector says after this sample
  void add(const Sample& sample, bool still);

  bool hasTaken() const { return taken_; }
  bool wasStopped() const { return stopped_; }  ///< The take of that stand, and not stored.
  bool left() const { return left_; }           ///< The taken stand, or the one the sensor was found at, has been left.
  double rested_s() const;                      ///< For how long it has stood still.

 private:
  double leave_distance_m_ = 0.05;
  bool taken_ = false;
  bool left_ = false;
  bool stopped_ = false;
  std::optional<Pose> stand_;
  std::deque<Pose> recent_;
  std::optional<double> still_since_s_;
  double newest_s_ = 0.0;
};

}  // namespace fieldtrue::acquisition
