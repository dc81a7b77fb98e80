#include "tests/studies/accuracy_study.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/calibration/alignment.h"
#include "calib/core/settings.h"
#include "calib/core/statistics.h"
#include "calib/correctors/automatic_choice.h"
#include "calib/correctors/base/method.h"
#include "calib/evaluation/base/noise_floor.h"
#include "tests/studies/rooms.h"
#include "tests/studies/table2.h"
#include "tests/studies/workers.h"

namespace fieldtrue::testing {
namespace {

/// A method of the tables.
struct Entry {
  std::string text;
  bool of_survey = true;
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> kEntries = [] {
    std::vector<Entry> all{{"none"},
                           {"affine"},
                           {"trilinear:resample=briggs"},
                           {"trilinear:resample=livingston"},
                           {"hexahedral_shape"},
                           {"tetrahedral"},
                           {"local_linear"},
                           {"local_bump"},
                           {"local_kindratenko:weight=linear"},
                           {"local_kindratenko:weight=log"},
                           {"local_briggs:resample=briggs"},
                           {"polynomial:degree=2"},
                           {"polynomial:degree=3"},
                           {"polynomial:degree=4"},
                           {"polynomial:degree=5"},
                           {"polynomial:degree=6"},
                           {"hmq:r2_cm2=10"},
                           {"hmq:r2_cm2=100"},
                           {"hmq:r2_cm2=1000"},
                           {"neural_network"},
                           {"rbf", false},
                           {"gaussian_process", false},
                           {"bspline", false},
                           {"harmonic_field", false}};
    std::erase_if(all,
                  [](const Entry& entry) { return !correctors::findPositionMethod(parseMethodText(entry.text)->id); });
    return all;
  }();
  return kEntries;
}

/// One room at one seed.
struct Outcome {
  double floor_mm = 0.0;          ///< Noise of the validation readings and tolerance of the jig.
  double known_physics_mm = 0.0;  ///< knownPhysicsRms_mm.
  double before_mm = 0.0;         ///< Against exact truth, after the rigid alignment.
  std::map<std::string, double> exact_mm;
  std::map<std::string, double> jig_mm;
  std::map<std::string, double> held_out_mm;  ///< By cross-validation on the fit nodes.
  std::string survey_pick;
  std::string our_pick;
};

correctors::AutomaticCandidate candidateOf(const std::string& text) {
  const MethodText parsed = orThrow(parseMethodText(text));
  const correctors::PositionMethod* method = orThrow(correctors::findPositionMethod(parsed.id));
  return {method, orThrow(resolveSettings(parsed.id, method->settings, parsed.given)), text, 0};
}

/// The methods that other ones are measured against stand in both sets.
bool isIn(const Entry& entry, bool of_survey) {
  return entry.of_survey == of_survey || entry.text == "none" || entry.text == "affine";
}

std::string lowestHeldOut(const std::map<std::string, double>& held_out_mm, bool of_survey) {
  std::string best;
  for (const Entry& entry : entries()) {
    const auto found = held_out_mm.find(entry.text);
    if (!isIn(entry, of_survey) || found == held_out_mm.end()) continue;
    if (best.empty() || found->second < held_out_mm.at(best)) best = entry.text;
  }
  return best;
}

Outcome runRoom(const std::string& room, std::uint64_t seed, int stride) {
  const simulation::Scene scene = readRoom(FIELDTRUE_RESOURCES, room);
  const RoomRecording recording = recordRoom(scene, seed, 200, stride);
  const calibration::Alignment alignment = orThrow(calibration::fitAlignment(recording.fit_nodes, std::nullopt));
  const correctors::FitData data = calibration::makeFitData(recording.fit_nodes, recording.table.metadata, alignment);
  const auto folds = correctors::innerFolds(data);
  Outcome outcome;
  outcome.floor_mm = evaluation::noiseFloor(recording.validation_nodes, recording.table.metadata).position_mm;
  outcome.known_physics_mm = knownPhysicsRms_mm(scene, recording, seed);
  for (const Entry& entry : entries()) {
    const correctors::AutomaticCandidate candidate = candidateOf(entry.text);
    const auto model = candidate.method->fit(data, candidate.settings, {});
    if (!model) continue;
    outcome.exact_mm[entry.text] = roomRms_mm(**model, alignment, recording.exact_nodes);
    outcome.jig_mm[entry.text] = roomRms_mm(**model, alignment, recording.validation_nodes);
    const correctors::InnerScore score = orThrow(correctors::scoreCandidate(candidate, data, folds, nullptr, {}));
    if (!score.skipped) outcome.held_out_mm[entry.text] = 1000.0 * score.rms_m();
  }
  outcome.before_mm = outcome.exact_mm.at("none");
  outcome.survey_pick = lowestHeldOut(outcome.held_out_mm, true);
  outcome.our_pick = lowestHeldOut(outcome.held_out_mm, false);
  return outcome;
}

std::string medianAndInterval(const std::vector<double>& values, const char* format = "%.2f (%.2f to %.2f)") {
  char text[96];
  std::snprintf(text, sizeof text, format, median(values), quantile(values, 0.05), quantile(values, 0.95));
  return text;
}

using ValueOf = std::function<double(const Outcome&)>;

std::vector<double> gather(const std::vector<Outcome>& outcomes, const ValueOf& value) {
  std::vector<double> values;
  for (const Outcome& outcome : outcomes) values.push_back(value(outcome));
  return values;
}

void printRow(const std::string& name, const std::map<std::string, std::vector<Outcome>>& by_room,
              const ValueOf& value) {
  std::printf("| %s |", name.c_str());
  for (const std::string& room : kRooms) {
    std::vector<double> values = gather(by_room.at(room), value);
    std::erase_if(values, [](double x) { return !(x > 0.0); });
    std::printf(" %s |", values.empty() ? "-" : medianAndInterval(values).c_str());
  }
  std::printf("\n");
}

void printHead(const char* first) {
  std::printf("\n| %s |", first);
  for (const std::string& room : kRooms) std::printf(" %s |", room.c_str());
  std::printf("\n|---|---|---|---|---|---|---|\n");
}

double valueOr0(const std::map<std::string, double>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? 0.0 : found->second;
}

void printMethods(const std::map<std::string, std::vector<Outcome>>& by_room,
                  std::map<std::string, double> Outcome::*score) {
  for (const Entry& entry : entries())
    printRow(entry.text, by_room, [&](const Outcome& outcome) { return valueOr0(outcome.*score, entry.text); });
  const auto survey = [score](const Outcome& o) { return (o.*score).at(o.survey_pick); };
  const auto ours = [score](const Outcome& o) { return (o.*score).at(o.our_pick); };
  printRow("**survey, picked**", by_room, survey);
  printRow("**ours, picked**", by_room, ours);
  printRow("ours / survey", by_room, [&](const Outcome& o) { return ours(o) / survey(o); });
}

void printPicks(const std::map<std::string, std::vector<Outcome>>& by_room) {
  std::printf("\nPicked by cross-validation on the fit nodes, how often:\n\n");
  for (const std::string& room : kRooms) {
    std::map<std::string, int> survey;
    std::map<std::string, int> ours;
    for (const Outcome& outcome : by_room.at(room)) {
      ++survey[outcome.survey_pick];
      ++ours[outcome.our_pick];
    }
    std::printf("- %s: survey", room.c_str());
    for (const auto& [name, count] : survey) std::printf(" %s %d,", name.c_str(), count);
    std::printf(" ours");
    for (const auto& [name, count] : ours) std::printf(" %s %d,", name.c_str(), count);
    std::printf("\n");
  }
}

void printTable2(const std::map<std::string, std::vector<Outcome>>& by_room) {
  printHead("technique (survey, table 2): rank here, by the lowest median error against exact truth");
  std::map<std::string, std::map<std::string, double>> errors_of_room;
  for (const std::string& room : kRooms) {
    std::map<std::string, double> median_mm;
    for (const Entry& entry : entries()) {
      const auto values = gather(by_room.at(room), [&](const Outcome& o) { return valueOr0(o.exact_mm, entry.text); });
      if (median(values) > 0.0) median_mm[entry.text] = median(values);
    }
    errors_of_room[room] = techniqueErrors(median_mm);
  }
  for (const Technique& technique : techniquesOfTable2()) {
    std::printf("| %s (%s) |", technique.name.c_str(), technique.survey_says.c_str());
    for (const std::string& room : kRooms) {
      const auto& errors = errors_of_room.at(room);
      if (errors.contains(technique.name))
        std::printf(" %d (%.1f mm) |", ranksOf(errors).at(technique.name), errors.at(technique.name));
      else
        std::printf(" - |");
    }
    std::printf("\n");
  }
  std::printf("| pairs in the survey's order |");
  for (const std::string& room : kRooms) {
    const Agreement agreement = agreementWithTable2(errors_of_room.at(room));
    std::printf(" %d of %d |", agreement.in_order, agreement.pairs);
  }
  std::printf("\n");
}

nlohmann::json toJson(const Outcome& outcome) {
  return {{"floor_mm", outcome.floor_mm},       {"known_physics_mm", outcome.known_physics_mm},
          {"before_mm", outcome.before_mm},     {"exact_mm", outcome.exact_mm},
          {"jig_mm", outcome.jig_mm},           {"held_out_mm", outcome.held_out_mm},
          {"survey_pick", outcome.survey_pick}, {"our_pick", outcome.our_pick}};
}

}  // namespace

nlohmann::json accuracyStudy(const StudyOptions& options) {
  std::map<std::string, std::vector<Outcome>> by_room;
  for (const std::string& room : kRooms) by_room[room].resize(static_cast<std::size_t>(options.seeds));
  const std::size_t n_jobs = kRooms.size() * static_cast<std::size_t>(options.seeds);
  inParallel(options.threads, n_jobs, "rooms", [&](std::size_t job) {
    const std::string& room = kRooms[job % kRooms.size()];
    const std::size_t seed = job / kRooms.size();
    by_room.at(room)[seed] = runRoom(room, seed + 1, options.stride);
  });
  printHead("error against exact truth, RMS mm");
  printRow("before (rigid alignment)", by_room, [](const Outcome& o) { return o.before_mm; });
  printRow("physics known, alignment fitted", by_room, [](const Outcome& o) { return o.known_physics_mm; });
  printMethods(by_room, &Outcome::exact_mm);
  printHead("error against places of the jig, RMS mm");
  printRow("floor (noise and jig)", by_room, [](const Outcome& o) { return o.floor_mm; });
  printMethods(by_room, &Outcome::jig_mm);
  printRow("survey / floor", by_room, [](const Outcome& o) { return o.jig_mm.at(o.survey_pick) / o.floor_mm; });
  printRow("ours / floor", by_room, [](const Outcome& o) { return o.jig_mm.at(o.our_pick) / o.floor_mm; });
  printPicks(by_room);
  printTable2(by_room);
  nlohmann::json json = nlohmann::json::object();
  for (const std::string& room : kRooms)
    for (const Outcome& outcome : by_room.at(room)) json[room].push_back(toJson(outcome));
  return json;
}

}  // namespace fieldtrue::testing
