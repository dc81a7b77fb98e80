#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/calibration/alignment.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/error_stats.h"

namespace fieldtrue::evaluation {
namespace {

using nlohmann::json;

/// What cannot be stated is null, never absent and never zero.
json nullUnless(bool stated, const json& value) { return stated ? value : json(nullptr); }

json ifFinite(double value) { return nullUnless(std::isfinite(value), value); }

json statsToJson(const ErrorStats& stats) {
  return {{"mean", stats.mean},
          {"median", stats.median},
          {"rms", stats.rms},
          {"p95", stats.p95},
          {"max", stats.max},
          {"rms_low90", ifFinite(stats.rms_low90)},
          {"rms_high90", ifFinite(stats.rms_high90)}};
}

json optionalToJson(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

json sensorsToJson(const std::vector<SensorScore>& sensors) {
  json to = json::array();
  for (const SensorScore& score : sensors) {
    json one = statsToJson(score.stats);
    one["sensor"] = score.sensor;
    one["n_places"] = score.places.size();
    to.push_back(std::move(one));
  }
  return to;
}

/// Of each sensor what is left before and with the best position method.
json beforeAndAfterToJson(const Comparison& comparison) {
  json to = sensorsToJson(comparison.before_sensors);
  const std::vector<SensorScore>& after = comparison.after_sensors;
  for (std::size_t i = 0; i < to.size(); ++i) to[i]["after"] = after.empty() ? json() : statsToJson(after[i].stats);
  return to;
}

json splitToJson(const SensorSplit& split, const std::string& unit) {
  const auto figure = [&](double value) { return nullUnless(split.is_told, ifFinite(value)); };
  return {{"shared_" + unit, figure(split.shared)},
          {"separate_" + unit, figure(split.separate)},
          {"separate_less_shared_" + unit, figure(split.separate_less_shared.difference)},
          {"low90", figure(split.separate_less_shared.low90)},
          {"high90", figure(split.separate_less_shared.high90)},
          {"separate_less_shared_in_shares", figure(split.separate_less_shared_in_shares.difference)},
          {"low90_in_shares", figure(split.separate_less_shared_in_shares.low90)},
          {"high90_in_shares", figure(split.separate_less_shared_in_shares.high90)},
          {"separate_is_better", split.is_better},
          {"text", split.text}};
}

json scoreToJson(const MethodScore& score, const char* stats_key, bool is_position) {
  const bool used = !score.skipped;
  json to = {{"method", score.method},
             {"settings", fieldtrue::toJson(score.settings)},
             {stats_key, nullUnless(used, statsToJson(score.stats))},
             {is_position ? "place_mm" : "place_deg", nullUnless(used, score.place_errors)},
             {"n_uncovered", nullUnless(used, score.n_uncovered)},
             {"fit_s", nullUnless(used, score.fit_s)},
             {"eval_ns", nullUnless(used, score.eval_ns)},
             {is_position ? "in_sample_rms_mm" : "in_sample_rms_deg", nullUnless(used, score.in_sample_rms)},
             {"rms_to_best", nullUnless(used, score.rms_to_best)},
             {"rms_to_best_low90", nullUnless(used, ifFinite(score.rms_to_best_low90))},
             {"rms_to_best_high90", nullUnless(used, ifFinite(score.rms_to_best_high90))},
             {"validated", nullUnless(used, toText(score.validated))},
             {"tuned_inside", nullUnless(used, score.tuned_inside)},
             {"n_folds", nullUnless(used, score.n_folds)},
             {"closed_form", nullUnless(used, score.closed_form)},
             {"notes", score.notes},
             {"skipped", nullUnless(!used, score.skipped.value_or(""))}};
  if (is_position) to["rms_common_mm"] = nullUnless(used, ifFinite(score.rms_common_mm));
  if (!score.sensors.empty()) to["sensors"] = sensorsToJson(score.sensors);
  const std::string key = stats_key;
  to[key + "_inside"] = score.inside ? statsToJson(*score.inside) : json(nullptr);
  to[key + "_edge"] = score.edge ? statsToJson(*score.edge) : json(nullptr);
  return to;
}

json testToJson(const GainTest& test) {
  return {{"gain", test.gain},
          {"low90", ifFinite(test.low90)},
          {"high90", ifFinite(test.high90)},
          {"worst_place", nullUnless(test.worst_place >= 0, test.worst_place)},
          {"gain_without_worst_place", ifFinite(test.gain_without_worst_place)},
          {"low90_without_worst_place", ifFinite(test.low90_without_worst_place)}};
}

json verdictToJson(const Verdict& verdict) {
  return {{"apply_position", verdict.apply_position},
          {"apply_orientation", verdict.apply_orientation},
          {"inside_out", verdict.is_inside_out},
          {"folding", verdict.is_folding},
          {"mirrored", nullUnless(!verdict.mirrored.empty(), verdict.mirrored)},
          {"gain_low90", ifFinite(verdict.gain_low90)},
          {"gain_high90", ifFinite(verdict.gain_high90)},
          {"gain_without_worst_place", ifFinite(verdict.gain_without_worst_place)},
          {"position", testToJson(verdict.position)},
          {"orientation", testToJson(verdict.orientation)},
          {"inside_mm", optionalToJson(verdict.inside_mm)},
          {"edge_mm", optionalToJson(verdict.edge_mm)},
          {"worst_place", nullUnless(verdict.worst_node >= 0, verdict.worst_node)},
          {"worst_mm", nullUnless(verdict.worst_node >= 0, verdict.worst_mm)},
          {"limited_by", nullUnless(!verdict.limited_by.empty(), verdict.limited_by)},
          {"text", verdict.text}};
}

/// Systematic error apart from the floor; null where no floor is stated, because then nothing is known apart.
json truenessToJson(const Comparison& comparison) {
  const Trueness& trueness = comparison.trueness;
  const bool position = comparison.floor_position_mm > 0.0;
  const bool orientation = comparison.floor_orientation_deg > 0.0;
  return {{"before",
           {{"position_mm", nullUnless(position, trueness.before_position_mm)},
            {"orientation_deg", nullUnless(orientation, optionalToJson(trueness.before_orientation_deg))}}},
          {"after",
           {{"position_mm", nullUnless(position, trueness.after_position_mm)},
            {"orientation_deg", nullUnless(orientation, optionalToJson(trueness.after_orientation_deg))}}}};
}

json resamplingToJson(const std::vector<ResamplingError>& errors) {
  json list = json::array();
  for (const ResamplingError& error : errors)
    list.push_back({{"method", error.method},
                    {"rms_mm", nullUnless(error.n_scored > 0, error.rms_mm)},
                    {"excess_mm", nullUnless(error.n_scored > 0, error.excess_mm)},
                    {"n_scored", error.n_scored},
                    {"n_without_support", error.n_without_support}});
  return list;
}

template <class Part>
json partToJson(const std::optional<Part>& part) {
  return part ? toJson(*part) : json(nullptr);
}

}  // namespace

json toJson(const Comparison& comparison) {
  json position = json::array();
  for (const MethodScore& score : comparison.position) position.push_back(scoreToJson(score, "position_mm", true));
  json orientation = json::array();
  for (const MethodScore& score : comparison.orientation)
    orientation.push_back(scoreToJson(score, "orientation_deg", false));
  const json before_orientation =
      comparison.before_orientation_deg ? statsToJson(*comparison.before_orientation_deg) : json();
  return {{"schema", "fieldtrue.compare/1"},
          {"software", "Fieldtrue " FIELDTRUE_VERSION},
          {"validate", toText(comparison.validation)},
          {"align", comparison.align == calibration::AlignMode::kRigid ? "rigid" : "none"},
          {"places", comparison.n_places},
          {"validation_places", comparison.validation_places},
          {"scored_places", comparison.places},
          {"scored_at_edge", comparison.is_edge},
          {"validated_share", comparison.validated_share},
          {"floor",
           {{"position_mm", nullUnless(comparison.floor_position_mm > 0.0, comparison.floor_position_mm)},
            {"orientation_deg", nullUnless(comparison.floor_orientation_deg > 0.0, comparison.floor_orientation_deg)},
            {"from", comparison.floor_from}}},
          {"before",
           {{"position_mm", statsToJson(comparison.before_position_mm)},
            {"orientation_deg", before_orientation},
            {"place_mm", comparison.before_place_mm},
            {"place_deg", comparison.before_place_deg}}},
          {"position", std::move(position)},
          {"orientation", std::move(orientation)},
          {"best", {{"position", comparison.best_position}, {"orientation", comparison.best_orientation}}},
          {"verdict", verdictToJson(comparison.verdict)},
          {"trueness", truenessToJson(comparison)},
          {"coverage", partToJson(comparison.coverage)},
          {"fold_back", partToJson(comparison.fold_back)},
          {"orientation_cover", partToJson(comparison.orientation_cover)},
          {"position_dependence", partToJson(comparison.position_dependence)},
          {"orientation_dependence", partToJson(comparison.orientation_dependence)},
          {"resampling", resamplingToJson(comparison.resampling)},
          {"sensors", beforeAndAfterToJson(comparison)},
          {"split", comparison.split ? splitToJson(*comparison.split, "mm") : json(nullptr)},
          {"orientation_split",
           comparison.orientation_split ? splitToJson(*comparison.orientation_split, "deg") : json(nullptr)},
          {"notes", comparison.notes}};
}

}  // namespace fieldtrue::evaluation
