#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// Whether a sample may enter an average: no error status, and finite numbers.
bool isGood(const Sample& sample);

/// What is seen of a sensor's rest.
enum class Rest {
  kUntold,    ///< It sends nothing that tells it: no signal, or too seldom.
  kWatching,  ///< What it sent is too little yet.
  kMoving,
  kResting,
};

/// Watches the stream of one sensor and says whether it stands still, with the reason in words.
class StillnessDetector {
 public:
  /// @param window_s how much of the stream is judged, in the samples' own time; more of a tracker of less than 10 Hz
  /// @param floor_m drift over the window up to this is never motion
  explicit StillnessDetector(double window_s = 0.5, double floor_m = 0.0005);
  void add(const Sample& sample);
  void clear();
  Rest rest() const;
  bool still() const { return rest() == Rest::kResting; }
  double speed_m_s() const;    ///< Drift of the mean over the window.
  double spread_m() const;     ///< 3-D SD within the window.
  std::string reason() const;  ///< "still", "hold still: moving 4 mm/s", "no signal: ..."

 private:
  struct Judgement {
    Rest rest = Rest::kWatching;
    double speed_m_s = 0.0;
    double spread_m = 0.0;
    std::string reason = "waiting for the tracker";
  };
  const Judgement& judgement() const;
  Judgement judge() const;
  std::size_t judgedSamples() const;  ///< Of the newest: those of the window, of a slow tracker at least a few.

  double window_s_;
  double floor_m_;
  std::vector<Sample> samples_;
  double step_s_ = 0.0;                         ///< From the last reading but one to the last.
  mutable std::optional<Judgement> judgement_;  ///< Of samples_, kept until the next sample.
};

}  // namespace fieldtrue::acquisition
