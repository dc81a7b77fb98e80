#include "calib/evaluation/sensor_scores.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "calib/core/number_text.h"
#include "calib/correctors/base/method_text.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/folds.h"
#include "calib/evaluation/place_scores.h"
#include "calib/evaluation/verdict.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {

namespace {

std::string splitText(const SensorSplit& split, const std::string& what, const char* unit,
                      const Validation& validation) {
  const PairedDifference& difference = split.separate_less_shared;
  const std::string figures = "corrected by itself, each sensor leaves " + errorText(split.separate) + " " + unit +
                              ", with the correction that all share " + errorText(split.shared) + " " + unit +
                              " (difference " + significantText(difference.low90) + " to " +
                              significantText(difference.high90) + " " + unit + "; " + toText(validation) + ")";
  if (split.is_better) return "The sensors err differently in " + what + ": " + figures + ".";
  if (difference.low90 > 0.0) return "The sensors share one correction of " + what + ": " + figures + ".";
  return "Nothing shows that the sensors err differently in " + what + ", so they share one correction: " + figures +
         ".";
}

/// What is left with one correction for all and with one for each, of a method that was the only one asked for.
SensorSplit splitOf(const Comparison& together, const Comparison& apart, bool of_position) {
  const std::string what = of_position ? "position" : "orientation";
  const auto& shared_scores = of_position ? together.position : together.orientation;
  const auto& separate_scores = of_position ? apart.position : apart.orientation;
  const MethodScore& shared = shared_scores.front();
  const MethodScore& separate = separate_scores.front();
  SensorSplit split;
  if (separate.skipped || shared.skipped) {
    split.is_told = false;
    split.text = "Whether the sensors err differently in " + what +
                 " cannot be told: " + separate.skipped.value_or(shared.skipped.value_or("")) + ".";
    return split;
  }
  const std::vector<double>& before = of_position ? apart.before_place_mm : apart.before_place_deg;
  split.shared = shared.stats.rms;
  split.separate = separate.stats.rms;
  split.separate_less_shared = pairedDifference(separate.place_errors, shared.place_errors);
  split.is_better = split.separate_less_shared.high90 < -kTie;
  split.gain = testGain(apart.places, before, separate.place_errors, separate.is_tuned);
  split.before = rootMeanSquare(before);
  split.after = separate.place_errors;
  split.text = splitText(split, what, of_position ? "mm" : "degrees", apart.validation);
  return split;
}

}  // namespace

std::vector<SensorScore> scoresBySensor(std::span<const Node> nodes, std::span<const RowScore> scores, bool is_tuned) {
  struct Rows {
    std::vector<Node> nodes;
    std::vector<RowScore> scores;
  };
  std::map<int, Rows> by_sensor;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Rows& rows = by_sensor[nodes[i].sensor];
    rows.nodes.push_back(nodes[i]);
    rows.scores.push_back(scores[i]);
  }
  std::vector<SensorScore> all;
  if (by_sensor.size() < 2) return all;
  for (const auto& [sensor, rows] : by_sensor) {
    SensorScore score;
    score.sensor = sensor;
    score.places = placesOf(rows.nodes);
    score.place_errors = gatherByPlace(score.places, rows.nodes, rows.scores).errors;
    score.stats = errorStats(score.place_errors, is_tuned);
    all.push_back(std::move(score));
  }
  return all;
}

Result<SensorSplits> splitsOf(const CalibrationTable& table, const calibration::CorrectorChoice& choice,
                              ComparisonOptions options, const RunControl& control) {
  const bool of_position = choice.position_id != "none", of_orientation = choice.orientation_id != "none";
  if (sensorsOf(table).size() < 2 || (!of_position && !of_orientation)) return SensorSplits{};
  FT_TRY(const MethodText position,
         parseMethodText(correctors::methodText(choice.position_id, choice.position_settings)));
  FT_TRY(const MethodText turn,
         parseMethodText(correctors::methodText(choice.orientation_id, choice.orientation_settings)));
  options.position_methods = {position};
  options.orientation_methods = {turn};
  // Left out one by one in closed form, the sensors could not be fitted apart.
  if (!options.validation || options.validation->kind == ValidationKind::kLeaveOneOut)
    options.validation = defaultValidation(table, true);
  options.with_surroundings = false;
  const auto together = compareMethods(table, options, partOf(control, 0.0, 0.4));
  options.separate_sensors = true;
  const auto apart = compareMethods(table, options, partOf(control, 0.4, 1.0));
  if (control.stop.stop_requested()) return comparisonStopped();
  if (!together || !apart) return SensorSplits{};
  SensorSplits splits;
  if (of_position) splits.position = splitOf(*together, *apart, true);
  if (of_orientation && together->before_orientation_deg) splits.orientation = splitOf(*together, *apart, false);
  return splits;
}

std::vector<Node> fitRowsOf(const CalibrationTable& table) {
  std::vector<Node> rows;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(rows),
               [](const Node& node) { return node.role == NodeRole::kFit; });
  return rows;
}

Result<calibration::Corrector> fitByEvidence(const CalibrationTable& table, calibration::CorrectorChoice choice,
                                             calibration::AlignMode align, const RunControl& control) {
  ComparisonOptions options;
  options.align = align;
  FT_TRY(const auto splits, splitsOf(table, choice, options, partOf(control, 0.0, 0.9)));
  choice.separate_position = splits.position && splits.position->is_better;
  choice.separate_orientation = splits.orientation && splits.orientation->is_better;
  FT_TRY(auto corrector,
         calibration::Corrector::fit(fitRowsOf(table), table.metadata, choice, align, partOf(control, 0.9, 1.0)));
  for (const auto* split : {&splits.position, &splits.orientation})
    if (*split) corrector = corrector.withNote((*split)->text);
  return corrector;
}

}  // namespace fieldtrue::evaluation
