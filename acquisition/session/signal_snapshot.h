#pragma once

#include <array>
#include <vector>

#include "acquisition/sampling/signal_questions.h"
#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// The signals of a tracker's sensors as they are now, and what it said of itself.
struct SignalSnapshot {
  std::vector<SensorSignal> sensors;
  TableMetadata tracker;
};

/// One sensor's signal with all that the questions about it need.
struct JudgedSignal {
  SignalReport report;
  std::vector<SecondMean> seconds;      ///< Since it rests.
  std::string hemisphere;               ///< As it is set; empty = the tracker has none, or it is not known.
  std::optional<double> expected_sd_m;  ///< Where it stands; none = not known of this tracker.
};
/// Takes tens of milliseconds a sensor.
std::vector<JudgedSignal> judged(const SignalSnapshot& snapshot);

/// One of the questions that decide a day.
struct SignalQuestion {
  const char* id;
  const char* text;
  Answer (*answer)(const JudgedSignal& signal, const Moves& moves);
};
/// In the order in which they are asked.
const std::array<SignalQuestion, 4>& signalQuestions();

}  // namespace fieldtrue::acquisition
