#include "calib/evaluation/sensor_splits.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "calib/calibration/placed_sensors.h"
#include "calib/core/number_text.h"
#include "calib/correctors/base/method_text.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/limits.h"
#include "calib/evaluation/verdict.h"
#include "calib/geometry/spacing.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {
namespace {

/// A correction for each sensor that lowers the RMS by less is not worth its further parts: as much as the automatic
/// choice asks of a method over none. Of 20 tables of two sensors alike, 8 cm apart in one field, affine fits apart
/// gained 1 to 3 %, one part in which either region is less curved than both; two strains that differ gain 40 %.
constexpr double kLeastGain = 0.05;

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

/// Whether all sensors stood at the same true positions, place by place: then they met the same field.
bool standAtTheSamePositions(const CalibrationTable& table, calibration::AlignMode align) {
  constexpr double kOneOfSpacing = 0.1;  // Over so little of it even a field that bends from place to place is one.
  const std::vector<Node> rows = calibration::placedSensors(table.nodes, align).nodes;
  std::map<int, std::map<int, std::vector<Eigen::Vector3d>>> p_m;  // By place and sensor.
  for (const Node& node : rows)
    if (node.role != NodeRole::kSkipped) p_m[node.node][node.sensor].push_back(node.reference_from_sensor.position_m);
  std::vector<Eigen::Vector3d> first_m;
  for (const auto& [place, of_sensor] : p_m) first_m.push_back(of_sensor.begin()->second.front());
  const double near_m = kOneOfSpacing * medianSpacing_m(first_m);
  const auto meet = [&](const std::vector<Eigen::Vector3d>& some_m, const std::vector<Eigen::Vector3d>& others_m) {
    return std::all_of(some_m.begin(), some_m.end(), [&](const Eigen::Vector3d& one_m) {
      return std::any_of(others_m.begin(), others_m.end(),
                         [&](const Eigen::Vector3d& other_m) { return (one_m - other_m).norm() <= near_m; });
    });
  };
  const std::size_t n_sensors = sensorsOf(table).size();
  return std::all_of(p_m.begin(), p_m.end(), [&](const auto& at) {
    return at.second.size() == n_sensors && std::all_of(at.second.begin(), at.second.end(), [&](const auto& one) {
             return meet(one.second, at.second.begin()->second);
           });
  });
}

/// Why one correction does not serve all. Sensors that stood at the same positions met the same field; others may have
/// met regions that are too unlike for a stiff method.
std::string apartText(const std::string& what, std::size_t n_sensors, bool is_one_region) {
  if (is_one_region) return "The sensors err differently in " + what;
  return "One correction of " + what + " by this method does not serve " + (n_sensors == 2 ? "both" : "all") +
         " sensors (they err differently, or it cannot follow the field where " + (n_sensors == 2 ? "both" : "all") +
         " stood)";
}

std::string splitText(const SensorSplit& split, const std::string& why_apart, const std::string& what, const char* unit,
                      const Validation& validation) {
  const PairedDifference& difference = split.separate_less_shared;
  const std::string figures = "corrected by itself, each sensor leaves " + errorText(split.separate) + " " + unit +
                              ", with the correction that all share " + errorText(split.shared) + " " + unit +
                              " (difference " + differenceText(difference.low90) + " to " +
                              differenceText(difference.high90) + " " + unit + "; " + toText(validation) + ")";
  if (split.is_better) return why_apart + ": " + figures + ".";
  if (difference.low90 > 0.0) return "The sensors share one correction of " + what + ": " + figures + ".";
  if (difference.high90 < -kTie)
    return "The sensors share one correction of " + what + ": " + figures + ", a gain below the " +
           percentText(kLeastGain) + " % that corrections apart need.";
  return "Nothing shows that the sensors err differently in " + what + ", so they share one correction: " + figures +
         ".";
}

/// Whether errors with separate corrections are surely and by enough below those with a shared one.
bool isLower(const PairedDifference& separate_less_shared, double shared) {
  return separate_less_shared.high90 < -kTie && separate_less_shared.difference <= -kLeastGain * shared;
}

/// Whether one sensor errs so much more than another, each by itself, that it would hide in millimetres what the other
/// gains.
bool isOneFarWorse(const std::vector<SensorScore>& separate) {
  // The same sensor errs up to twice as much 8 cm nearer to metal; one that scatters is told from 5 times on.
  constexpr double kFarWorse = 3.0;
  const auto [least, most] =
      std::minmax_element(separate.begin(), separate.end(),
                          [](const SensorScore& a, const SensorScore& b) { return a.stats.rms < b.stats.rms; });
  return most->stats.rms > kFarWorse * least->stats.rms;
}

/// The same of each sensor's errors in shares of what the shared correction leaves of it. In all, the sensors may not
/// be surely worse for it: what one scatters makes either correction the smaller by chance.
bool isLowerInShares(SensorSplit& split, const MethodScore& shared, const MethodScore& separate) {
  if (shared.sensors.empty() || shared.sensors.size() != separate.sensors.size()) return false;
  const std::vector<double> shares = inShares(shared.sensors, shared.sensors);
  split.separate_less_shared_in_shares =
      pairedDifference(inShares(separate.sensors, shared.sensors), shares, separate.freedom.positions_a_place);
  return isOneFarWorse(separate.sensors) && !(split.separate_less_shared.low90 > kTie) &&
         isLower(split.separate_less_shared_in_shares, rootMeanSquare(shares));
}

/// What is left with one correction for all and with one for each, of a method that was the only one asked for.
/// @param is_one_region whether the sensors stood at the same true positions
SensorSplit splitOf(const Comparison& together, const Comparison& apart, bool of_position, bool is_one_region) {
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
  split.separate_less_shared =
      pairedDifference(separate.place_errors, shared.place_errors, separate.freedom.positions_a_place);
  const bool is_lower = isLower(split.separate_less_shared, split.shared);
  split.is_better = isLowerInShares(split, shared, separate) || is_lower;
  split.gain = testGain(apart.places, before, separate.place_errors, separate.freedom);
  split.before = rootMeanSquare(before);
  split.after = separate.place_errors;
  split.sensors = separate.sensors;
  const char* unit = of_position ? "mm" : "degrees";
  const std::string why_apart = apartText(what, separate.sensors.size(), is_one_region);
  if (split.is_better && !isApart(split))
    split.text = harmfulText(split, what, unit, apart.validation);
  else if (split.is_better && !is_lower)
    split.text = unequalText(what, unit, separate.sensors, shared.sensors, apart.validation);
  else
    split.text = splitText(split, why_apart, what, unit, apart.validation);
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
  comparison.after_sensors = comparison.split->sensors;
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
  if (!options.validation) options.validation = defaultValidation(table, true);
  options.with_surroundings = false;
  const auto together = compareMethods(table, options, partOf(control, 0.0, 0.4));
  options.separate_sensors = true;
  const auto apart = compareMethods(table, options, partOf(control, 0.4, 1.0));
  if (control.stop.stop_requested()) return comparisonStopped();
  if (!together || !apart) return SensorSplits{};
  const bool is_one_region = standAtTheSamePositions(table, together->align);
  SensorSplits splits;
  if (of_position) splits.position = splitOf(*together, *apart, true, is_one_region);
  if (of_orientation && together->before_orientation_deg)
    splits.orientation = splitOf(*together, *apart, false, is_one_region);
  return splits;
}

std::vector<Node> fitRowsOf(const CalibrationTable& table) {
  std::vector<Node> rows;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(rows),
               [](const Node& node) { return node.role == NodeRole::kFit; });
  return rows;
}

Result<void> checkFitRows(const CalibrationTable& table) {
  if (!fitRowsOf(table).empty()) return {};
  const bool is_skipped = std::all_of(table.nodes.begin(), table.nodes.end(),
                                      [](const Node& node) { return node.role == NodeRole::kSkipped; });
  return fail(ErrorCode::kTooFewNodes,
              table.nodes.empty() ? "The table has no rows to fit"
              : is_skipped        ? "Every row of the table is skipped; nothing is left to fit"
                                  : "Every row of the table is for validation or skipped; nothing is left to fit");
}

Result<calibration::Corrector> fitByEvidence(const CalibrationTable& table, calibration::CorrectorChoice choice,
                                             calibration::AlignMode align, const RunControl& control) {
  FT_TRY_VOID(checkFitRows(table));
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
