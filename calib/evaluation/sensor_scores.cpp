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
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {

namespace {

std::string splitText(const SensorSplit& split, const char* unit, const Validation& validation) {
  const std::string figures = "corrected by itself, each sensor leaves " + errorText(split.separate) + " " + unit +
                              ", with the correction that all share " + errorText(split.shared) + " " + unit +
                              " (difference " + significantText(split.separate_less_shared.low90) + " to " +
                              significantText(split.separate_less_shared.high90) + " " + unit + "; " +
                              toText(validation) + ")";
  return (split.is_better ? "The sensors err differently: " : "The sensors share one correction: ") + figures + ".";
}

/// What the choice's position method leaves at each place, or its orientation method where position is left as it is.
std::optional<MethodScore> judged(const CalibrationTable& table, const ComparisonOptions& options, bool by_position,
                                  const RunControl& control) {
  const auto compared = compareMethods(table, options, control);
  if (!compared) return std::nullopt;
  const std::vector<MethodScore>& scores = by_position ? compared->position : compared->orientation;
  return scores.empty() || scores.front().skipped ? std::nullopt : std::optional(scores.front());
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

Result<std::optional<SensorSplit>> splitOf(const CalibrationTable& table, const calibration::CorrectorChoice& choice,
                                           ComparisonOptions options, const RunControl& control) {
  const bool by_position = choice.position_id != "none";
  if (sensorsOf(table).size() < 2 || (!by_position && choice.orientation_id == "none")) return std::nullopt;
  FT_TRY(const MethodText position,
         parseMethodText(correctors::methodText(choice.position_id, choice.position_settings)));
  FT_TRY(const MethodText turn,
         parseMethodText(correctors::methodText(choice.orientation_id, choice.orientation_settings)));
  options.position_methods = {by_position ? position : MethodText{"none", {}}};
  options.orientation_methods = {by_position ? MethodText{"none", {}} : turn};
  // Left out one by one in closed form, the sensors could not be fitted apart.
  if (!options.validation || options.validation->kind == ValidationKind::kLeaveOneOut)
    options.validation = defaultValidation(table, true);
  options.with_surroundings = false;
  const auto together = judged(table, options, by_position, partOf(control, 0.0, 0.4));
  options.separate_sensors = true;
  const auto apart = together ? judged(table, options, by_position, partOf(control, 0.4, 1.0)) : std::nullopt;
  if (control.stop.stop_requested()) return comparisonStopped();
  if (!together || !apart || together->place_errors.size() != apart->place_errors.size()) return std::nullopt;
  SensorSplit split;
  split.shared = together->stats.rms;
  split.separate = apart->stats.rms;
  split.separate_less_shared = pairedDifference(apart->place_errors, together->place_errors);
  split.is_better = split.separate_less_shared.high90 < 0.0;
  split.text = splitText(split, by_position ? "mm" : "degrees", *options.validation);
  return split;
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
  FT_TRY(const auto split, splitOf(table, choice, options, partOf(control, 0.0, 0.9)));
  choice.separate_sensors = split && split->is_better;
  FT_TRY(auto corrector,
         calibration::Corrector::fit(fitRowsOf(table), table.metadata, choice, align, partOf(control, 0.9, 1.0)));
  return split ? corrector.withNote(split->text) : corrector;
}

}  // namespace fieldtrue::evaluation
