#include "acquisition/session/signal_snapshot.h"

#include "acquisition/devices/registry.h"

namespace fieldtrue::acquisition {

namespace {

std::string textAt(const std::map<std::string, std::string>& texts, const std::string& key) {
  const auto found = texts.find(key);
  return found == texts.end() ? std::string() : found->second;
}

}  // namespace

std::vector<JudgedSignal> judged(const SignalSnapshot& snapshot) {
  const auto& setup = snapshot.tracker.setup;
  const auto known = setup.find("tracker_kind");
  const std::string kind = known == setup.end() ? std::string() : known->second;
  std::vector<JudgedSignal> of_sensors;
  for (const SensorSignal& sensor : snapshot.sensors) {
    JudgedSignal signal{signalReport(sensor), sensor.seconds, textAt(snapshot.tracker.other, kind + "_hemisphere"), {}};
    if (signal.report.stand) signal.expected_sd_m = expectedNoise_m(kind, signal.report.stand->position_m.norm());
    of_sensors.push_back(std::move(signal));
  }
  return of_sensors;
}

const std::array<SignalQuestion, 4>& signalQuestions() {
  static constexpr std::array<SignalQuestion, 4> kQuestions{{
      {"hemisphere", "Right hemisphere?",
       [](const JudgedSignal& signal, const Moves& moves) {
         return hemisphereAnswer(signal.report, moves, signal.hemisphere);
       }},
      {"axes", "Axes as you think?", [](const JudgedSignal&, const Moves& moves) { return axesAnswer(moves); }},
      {"warm_up", "Still warming up?",
       [](const JudgedSignal& signal, const Moves&) { return warmUpAnswer(signal.report); }},
      {"noise", "Noise as it should be here?",
       [](const JudgedSignal& signal, const Moves&) { return noiseAnswer(signal.report, signal.expected_sd_m); }},
  }};
  return kQuestions;
}

}  // namespace fieldtrue::acquisition
