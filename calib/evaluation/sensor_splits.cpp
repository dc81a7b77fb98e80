#include "calib/evaluation/sensor_splits.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "calib/core/number_text.h"
#include "calib/correctors/base/method_text.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/limits.h"
#include "calib/evaluation/verdict.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {
namespace {

/// Nothing where it is below what any tracker tells.
std::string differenceText(double difference) {
  constexpr double kLeast = 5e-4;  // Millimetres or degrees.
  return std::abs(difference) < kLeast ? "0" : significantText(difference);
}

/// Errors of places, each sensor's as a share of what a correction leaves of it in all.
/// @param shared what that correction leaves, of the same sensors
std::vector<double> inShares(const std::vector<SensorScore>& sensors, const std::vector<SensorScore>& shared) {
  struct Sum {
    double squares = 0.0;
    int n = 0;
  };
  std::map<int, Sum> by_place;
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    for (std::size_t i = 0; i < sensors[k].places.size(); ++i) {
      const double share = sensors[k].place_errors[i] / std::max(kTie, shared[k].stats.rms);
      Sum& sum = by_place[sensors[k].places[i]];
      sum.squares += share * share;
      ++sum.n;
    }
  }
  std::vector<double> errors;
  for (const auto& [place, sum] : by_place) errors.push_back(std::sqrt(sum.squares / sum.n));
  return errors;
}

/// "sensor 1 20.1 mm, sensor 2 3.4 mm"
std::string bySensorText(const std::vector<SensorScore>& sensors, const char* unit) {
  std::string text;
  for (const SensorScore& one : sensors)
    text.append(text.empty() ? "sensor " : ", sensor ")
        .append(std::to_string(one.sensor) + " " + errorText(one.stats.rms) + " " + unit);
  return text;
}

/// Of sensors of which one scatters far more than another.
std::string unequalText(const std::string& what, const char* unit, const std::vector<SensorScore>& separate,
                        const std::vector<SensorScore>& shared, const Validation& validation) {
  return "Each sensor has a correction of " + what + " of its own, since one would spoil what they share: by itself " +
         bySensorText(separate, unit) + ", with the correction that all share " + bySensorText(shared, unit) + " (" +
         toText(validation) + ").";
}

/// Of corrections for each sensor that are better than one for all, and worse than none.
std::string harmfulText(const SensorSplit& split, const std::string& what, const char* unit,
                        const Validation& validation) {
  return "No correction of " + what +
         " helps, neither one that all sensors share nor one for each: " + errorText(split.shared) + " and " +
         errorText(split.separate) + " " + unit + ", without any " + errorText(split.before) + " " + unit + " (" +
         toText(validation) + ").";
}

std::string splitText(const SensorSplit& split, const std::string& what, const char* unit,
                      const Validation& validation) {
  const PairedDifference& difference = split.separate_less_shared;
  const std::string figures = "corrected by itself, each sensor leaves " + errorText(split.separate) + " " + unit +
                              ", with the correction that all share " + errorText(split.shared) + " " + unit +
                              " (difference " + differenceText(difference.low90) + " to " +
                              differenceText(difference.high90) + " " + unit + "; " + toText(validation) + ")";
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
  const double positions_a_place = separate.freedom.positions_a_place;
  split.separate_less_shared = pairedDifference(separate.place_errors, shared.place_errors, positions_a_place);
  split.is_better = split.separate_less_shared.high90 < -kTie;
  if (!shared.sensors.empty() && shared.sensors.size() == separate.sensors.size()) {
    split.separate_less_shared_in_shares = pairedDifference(
        inShares(separate.sensors, shared.sensors), inShares(shared.sensors, shared.sensors), positions_a_place);
    split.is_better = split.is_better || split.separate_less_shared_in_shares.high90 < -kTie;
  }
  split.gain = testGain(apart.places, before, separate.place_errors, separate.freedom);
  split.before = rootMeanSquare(before);
  split.after = separate.place_errors;
  const char* unit = of_position ? "mm" : "degrees";
  const bool only_in_shares = split.is_better && split.separate_less_shared.high90 >= -kTie;
  if (split.is_better && !isApart(split))
    split.text = harmfulText(split, what, unit, apart.validation);
  else
    split.text = only_in_shares ? unequalText(what, unit, separate.sensors, shared.sensors, apart.validation)
                                : splitText(split, what, unit, apart.validation);
  return split;
}

/// Rows of the methods by which it is asked whether sensors want a correction each: the best one, or, where none beats
/// the error before (errors that are opposite leave nothing to share), those that come nearest.
std::vector<std::size_t> rowsToSplit(const std::vector<MethodScore>& scores, std::optional<std::size_t> best,
                                     const Comparison& comparison) {
  constexpr std::size_t kMost = 3;
  if (best) return {*best};
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < scores.size(); ++row)
    if (!scores[row].skipped && scores[row].method != "none" && scores[row].method != "rigid" &&
        isRanked(scores[row], comparison))
      rows.push_back(row);
  std::stable_sort(rows.begin(), rows.end(),
                   [&](std::size_t a, std::size_t b) { return scores[a].stats.rms < scores[b].stats.rms; });
  if (rows.size() > kMost) rows.resize(kMost);
  return rows;
}

/// A split and the row of the method that it is of.
struct SplitOfRow {
  std::optional<SensorSplit> split;
  std::size_t row = 0;

  /// What is told counts before what is not, and of that what leaves least.
  bool isBetterThan(const SplitOfRow& other) const {
    if (!split || !other.split) return split.has_value();
    if (split->is_told != other.split->is_told) return split->is_told;
    return split->is_told && split->separate < other.split->separate;
  }
};

Result<SplitOfRow> bestSplit(const Comparison& comparison, bool of_position, const CalibrationTable& table,
                             const ComparisonOptions& options, const RunControl& control) {
  const std::vector<MethodScore>& scores = of_position ? comparison.position : comparison.orientation;
  const auto best = of_position ? comparison.best_position_row : comparison.best_orientation_row;
  SplitOfRow kept;
  for (const std::size_t row : rowsToSplit(scores, best, comparison)) {
    calibration::CorrectorChoice choice;
    (of_position ? choice.position_id : choice.orientation_id) = scores[row].method;
    (of_position ? choice.position_settings : choice.orientation_settings) = scores[row].settings;
    FT_TRY(auto splits, splitsOf(table, choice, options, control));
    SplitOfRow asked{std::move(of_position ? splits.position : splits.orientation), row};
    if (asked.isBetterThan(kept)) kept = std::move(asked);
  }
  return kept;
}

void takePosition(Comparison& comparison, std::size_t row) {
  comparison.best_position_row = row;
  comparison.best_position = comparison.position[row].method;
  tellDistanceTo(comparison.split->after, comparison.position);
  comparison.trueness.after_position_mm = excessError(comparison.split->separate, comparison.floor_position_mm);
  judgePosition(comparison.verdict, comparison.split->gain);
  comparison.verdict.limited_by.clear();
  judgePlaces(comparison);
}

void takeOrientation(Comparison& comparison, std::size_t row) {
  comparison.best_orientation_row = row;
  tellDistanceTo(comparison.orientation_split->after, comparison.orientation);
  comparison.best_orientation = comparison.orientation[row].method;
  comparison.trueness.after_orientation_deg =
      excessError(comparison.orientation_split->separate, comparison.floor_orientation_deg);
  comparison.verdict.orientation = comparison.orientation_split->gain;
  comparison.verdict.apply_orientation = comparison.verdict.orientation.apply;
}

}  // namespace

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

Result<void> addSplits(Comparison& comparison, const CalibrationTable& table, const ComparisonOptions& options,
                       const RunControl& control) {
  if (sensorsOf(table).size() < 2) return {};
  ComparisonOptions alike = options;
  alike.validation = comparison.validation;
  alike.align = comparison.align;
  RunControl quiet = control;
  quiet.progress = [](double) {};
  FT_TRY(auto of_position, bestSplit(comparison, true, table, alike, quiet));
  FT_TRY(auto of_orientation, bestSplit(comparison, false, table, alike, quiet));
  for (const SplitOfRow* asked : {&of_position, &of_orientation})
    if (asked->split) comparison.notes.push_back(asked->split->text);
  comparison.split = std::move(of_position.split);
  comparison.orientation_split = std::move(of_orientation.split);
  if (comparison.verdict.is_inside_out) return {};
  if (isApart(comparison.split)) takePosition(comparison, of_position.row);
  if (isApart(comparison.orientation_split)) takeOrientation(comparison, of_orientation.row);
  return {};
}

}  // namespace fieldtrue::evaluation
