#include "widgets/report/report_data.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "widgets/report/numbers.h"

namespace fieldtrue::widgets {
namespace {

std::optional<double> sd_mm(const Node& node) {
  if (!node.covariance_m2) return std::nullopt;
  return kMmPerM * std::sqrt(node.covariance_m2->trace());
}

std::optional<double> medianOf(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  return median(values);
}

/// Undoes n_effective = n (1 - rho) / (1 + rho).
double autocorrelation(const Node& node) {
  const double ratio = node.n_effective / node.n_used;
  return (1.0 - ratio) / (1.0 + ratio);
}

/// Adds a row of the table to its place.
void addRow(PlaceSummary& place, const Node& node, bool first, double& variance_mm2, int& n_variances) {
  if (first) {
    place.p_true_m = node.reference_from_sensor.position_m;
    place.name = placeName({node.node, node.visit, node.index, node.reference_from_sensor, node.role});
    place.validation = node.role == NodeRole::kValidation;
  }
  place.n_used += node.n_used;
  place.n_rejected += node.n_rejected;
  if (const auto sd = sd_mm(node)) {
    variance_mm2 += *sd * *sd;
    ++n_variances;
  }
}

PlaceSummary summarise(int node, const std::vector<const Node*>& rows) {
  PlaceSummary place;
  place.node = node;
  double variance_mm2 = 0.0;
  int n_variances = 0;
  for (const Node* row : rows) addRow(place, *row, row == rows.front(), variance_mm2, n_variances);
  if (n_variances > 0) place.sd_mm = std::sqrt(variance_mm2 / n_variances);
  return place;
}

}  // namespace

const evaluation::MethodScore* bestPosition(const evaluation::Comparison& comparison) {
  return comparison.best_position_row ? &comparison.position.at(*comparison.best_position_row) : nullptr;
}

const evaluation::MethodScore* bestOrientation(const evaluation::Comparison& comparison) {
  return comparison.best_orientation_row ? &comparison.orientation.at(*comparison.best_orientation_row) : nullptr;
}

std::vector<PlaceSummary> placeSummaries(const ReportInput& input) {
  std::map<int, std::vector<const Node*>> rows_of;
  for (const Node& node : input.table.nodes) {
    if (node.role != NodeRole::kSkipped) rows_of[node.node].push_back(&node);
  }
  const evaluation::Comparison& comparison = input.comparison;
  const evaluation::MethodScore* best = bestPosition(comparison);
  std::vector<PlaceSummary> places;
  places.reserve(comparison.places.size());
  for (std::size_t i = 0; i < comparison.places.size(); ++i) {
    PlaceSummary place = summarise(comparison.places[i], rows_of[comparison.places[i]]);
    place.before_mm = comparison.before_place_mm[i];
    place.before_m = comparison.before_residual_m[i];
    if (!comparison.before_place_deg.empty()) place.before_deg = comparison.before_place_deg[i];
    place.after_mm = best != nullptr ? best->place_errors[i] : place.before_mm;
    place.after_m = best != nullptr ? best->residual_m[i] : place.before_m;
    places.push_back(std::move(place));
  }
  return places;
}

MeasurementSummary measurementSummary(const CalibrationTable& table) {
  MeasurementSummary summary;
  std::set<int> sensors;
  std::vector<double> sds_mm, sds_deg, autocorrelations, times_s;
  for (const Node& node : table.nodes) {
    if (node.role == NodeRole::kSkipped) {
      ++summary.n_skipped_rows;
      continue;
    }
    ++summary.n_rows;
    sensors.insert(node.sensor);
    summary.n_used += node.n_used;
    summary.n_rejected += node.n_rejected;
    summary.has_orientation = summary.has_orientation || node.has_orientation;
    if (const auto sd = sd_mm(node)) sds_mm.push_back(*sd);
    if (node.sd_rot_rad) sds_deg.push_back(kDegPerRad * *node.sd_rot_rad);
    if (node.n_used > 1) autocorrelations.push_back(autocorrelation(node));
    if (node.t_start_s) times_s.push_back(*node.t_start_s);
    if (node.t_end_s) times_s.push_back(*node.t_end_s);
  }
  summary.n_sensors = static_cast<int>(sensors.size());
  summary.sd_mm = medianOf(sds_mm);
  summary.sd_deg = medianOf(sds_deg);
  summary.autocorrelation = medianOf(autocorrelations);
  if (!times_s.empty()) {
    const auto [first, last] = std::minmax_element(times_s.begin(), times_s.end());
    summary.duration_s = *last - *first;
  }
  return summary;
}

std::string settingsText(const Settings& settings) {
  std::string text;
  for (const auto& [key, value] : settings) {
    if (!text.empty()) text += ", ";
    text += key + "=";
    if (const auto* flag = std::get_if<bool>(&value)) text += *flag ? "true" : "false";
    if (const auto* whole = std::get_if<std::int64_t>(&value)) text += std::to_string(*whole);
    if (const auto* number = std::get_if<double>(&value)) text += formatNumber(*number);
    if (const auto* choice = std::get_if<std::string>(&value)) text += *choice;
  }
  return text;
}

std::string cautionText(const evaluation::Comparison& comparison) {
  const evaluation::MethodScore* best = bestPosition(comparison);
  if (!comparison.verdict.apply_position || best == nullptr) return {};
  std::string text;
  if (comparison.fold_back && comparison.fold_back->n_folded > 0)
    text = evaluation::foldsByItself(*comparison.fold_back) ? "the correction folds back" : "the field folds back";
  if (best->stats.max >= comparison.before_position_mm.max)
    text += (text.empty() ? "" : " and ") + std::string("the worst place is no better");
  if (comparison.validated_share < 0.5)
    text += (text.empty() ? "" : " and ") + std::string("the places that judge it span a part of the region");
  return text;
}

std::string notComparedText(const evaluation::Comparison& comparison) {
  std::string names;
  for (const correctors::PositionMethod& method : correctors::positionMethods()) {
    const auto is_method = [&](const evaluation::MethodScore& score) { return score.method == method.id; };
    if (std::any_of(comparison.position.begin(), comparison.position.end(), is_method)) continue;
    names += (names.empty() ? "" : "; ") + std::string(method.label);  // Some have a comma.
  }
  return names;
}

std::string toBestText(const evaluation::MethodScore& score, bool is_best) {
  if (is_best) return "best";
  const auto figure = [](double value) { return value < 0.0 ? "-" + errorFigure(-value) : errorFigure(value); };
  const bool as_good = score.rms_to_best_low90 <= 0.0;
  const std::string difference = (score.rms_to_best < 0.0 ? "" : "+") + figure(score.rms_to_best);
  if (!std::isfinite(score.rms_to_best_low90)) return difference;
  return difference + " (" + figure(score.rms_to_best_low90) + " to " + figure(score.rms_to_best_high90) + ")" +
         (as_good ? ", as good" : "");
}

std::string truenessText(const evaluation::Comparison& comparison) {
  std::string text;
  const evaluation::Trueness& trueness = comparison.trueness;
  if (comparison.floor_position_mm > 0.0)
    text = errorFigure(trueness.before_position_mm) + " mm before and " + errorFigure(trueness.after_position_mm) +
           " mm after the best position method";
  if (comparison.floor_orientation_deg > 0.0 && trueness.before_orientation_deg && trueness.after_orientation_deg)
    text += (text.empty() ? "" : ", ") + errorFigure(*trueness.before_orientation_deg) + " deg before and " +
            errorFigure(*trueness.after_orientation_deg) + " deg after the best orientation method";
  return text.empty() ? text : "Systematic error apart from the noise floor: " + text + ".";
}

std::string sensorsText(const evaluation::Comparison& comparison) {
  std::string text;
  for (std::size_t i = 0; i < comparison.before_sensors.size(); ++i) {
    const evaluation::SensorScore& before = comparison.before_sensors[i];
    text += (text.empty() ? "Sensor " : " Sensor ") + std::to_string(before.sensor) + ": " +
            errorFigure(before.stats.rms) + " mm before";
    if (!comparison.after_sensors.empty())
      text += ", " + errorFigure(comparison.after_sensors[i].stats.rms) + " mm with the best method";
    text += ", at " + std::to_string(before.places.size()) + " places.";
  }
  return text;
}

std::string resamplingText(const evaluation::Comparison& comparison) {
  std::string text;
  for (const evaluation::ResamplingError& error : comparison.resampling) {
    text += (text.empty() ? "" : ", ") + error.method + " ";
    if (error.n_scored > 0)
      text += errorFigure(error.rms_mm) + " mm (" + errorFigure(error.excess_mm) + " above the noise floor, " +
              std::to_string(error.n_without_support) + " places without support)";
    else
      text += "has support at no place";
  }
  return text.empty() ? text : "Error that resampling adds by itself, each place left out in turn: " + text + ".";
}

std::string floorText(const evaluation::Comparison& comparison) {
  std::string text;
  if (comparison.floor_position_mm > 0.0) text = significantText(comparison.floor_position_mm) + " mm";
  if (comparison.floor_orientation_deg > 0.0) {
    text += (text.empty() ? "" : ", ") + significantText(comparison.floor_orientation_deg) + " deg";
  }
  if (text.empty()) return "not known: the table states neither noise nor tolerance";
  return text + " (from " + comparison.floor_from + ")";
}

}  // namespace fieldtrue::widgets
