#include "calib/gap/report_json.h"

#include <cmath>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/recording/finding.h"

namespace fieldtrue::gap {

namespace {

using nlohmann::json;

json numberToJson(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json numberToJson(const std::optional<double>& value) { return value ? numberToJson(*value) : json(nullptr); }

json vectorToJson(const Eigen::Vector3d& v, double factor = 1.0) {
  return {numberToJson(factor * v.x()), numberToJson(factor * v.y()), numberToJson(factor * v.z())};
}

json matrixToJson(const Eigen::Matrix3d& matrix) {
  json rows = json::array();
  for (int row = 0; row < 3; ++row) rows.push_back(vectorToJson(matrix.row(row).transpose()));
  return rows;
}

json poseToJson(const Pose& pose) {
  const Eigen::Quaterniond q = canonical(pose.orientation);
  return {{"t_m", vectorToJson(pose.position_m)}, {"q_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

template <class Items, class ToJson>
json listToJson(const Items& items, ToJson to_json) {
  json list = json::array();
  for (const auto& item : items) list.push_back(to_json(item));
  return list;
}

json mountsToJson(const std::map<int, Pose>& mounts) {
  json list = json::array();
  for (const auto& [sensor, mount] : mounts) {
    list.push_back(poseToJson(mount));
    list.back()["sensor"] = sensor;
  }
  return list;
}

json inputToJson(const GapReport::Input& input) {
  return {{"places", input.places},
          {"rows", input.rows},
          {"samples", input.samples},
          {"orientations", input.orientations},
          {"position_only", input.position_only}};
}

json gapToJson(const GapReport& report) {
  return {{"position_rms_mm", numberToJson(report.position_rms_mm)},
          {"orientation_rms_deg", numberToJson(report.orientation_rms_deg)},
          {"floor_position_mm", numberToJson(report.floor_position_mm)},
          {"floor_orientation_deg", numberToJson(report.floor_orientation_deg)},
          {"ratio_to_floor", numberToJson(report.ratio_to_floor)},
          {"p_value", numberToJson(report.p_value)}};
}

json nodeToJson(const GapNode& node, bool position_only) {
  json to = {{"node", node.node},
             {"visit", node.visit},
             {"sensor", node.sensor},
             {"gap_mm", numberToJson(kMmPerM * node.before_m.norm())},
             {"gap_deg", nullptr},
             {"excess", numberToJson(node.excess)},
             {"flagged", node.is_flagged},
             {"place_m", vectorToJson(node.place_m)},
             {"before_mm", vectorToJson(node.before_m, kMmPerM)},
             {"after_mm", vectorToJson(node.after_m, kMmPerM)},
             {"before_deg", nullptr},
             {"after_deg", nullptr}};
  if (position_only) return to;
  to["gap_deg"] = numberToJson(kDegPerRad * node.before_rad.norm());
  to["before_deg"] = vectorToJson(node.before_rad, kDegPerRad);
  to["after_deg"] = vectorToJson(node.after_rad, kDegPerRad);
  return to;
}

json binToJson(const GapBin& bin, const char* low_key, const char* high_key) {
  json to = {
      {low_key, numberToJson(bin.low)}, {"rms_mm", numberToJson(bin.rms_mm)}, {"floor_mm", numberToJson(bin.floor_mm)}};
  if (high_key != nullptr) to[high_key] = numberToJson(bin.high);
  return to;
}

json binsToJson(const std::vector<GapBin>& bins, const char* low_key, const char* high_key) {
  return listToJson(bins, [&](const GapBin& bin) { return binToJson(bin, low_key, high_key); });
}

json channelToJson(const GapChannel& channel) {
  return {{"name", channel.name},
          {"rms", numberToJson(channel.rms)},
          {"unit", channel.unit},
          {"floor", numberToJson(channel.floor)}};
}

json sourceShapeToJson(const SourceShape& shape) {
  json axes = json::array();
  for (int k = 0; k < 3; ++k) axes.push_back(vectorToJson(shape.axes.col(k)));
  return {{"shape", idOf(shape.shape)},
          {"center_m", vectorToJson(shape.center_m)},
          {"polarizabilities_m3", vectorToJson(shape.values_m3)},
          {"sd_m3", vectorToJson(shape.sds_m3)},
          {"axes", std::move(axes)}};
}

json whereToJson(const GapReport& report) {
  json to = {{"nodes", listToJson(report.nodes,
                                  [&](const GapNode& node) { return nodeToJson(node, report.input.position_only); })},
             {"hotspot", nullptr},
             {"source_shape", nullptr},
             {"channels", listToJson(report.channels, channelToJson)},
             {"by_range", binsToJson(report.by_range, "low_m", "high_m")},
             {"by_layer", binsToJson(report.by_layer, "layer", nullptr)},
             {"by_time", binsToJson(report.by_time, "t_start_s", "t_end_s")},
             {"origin",
              {{"room", numberToJson(report.origin.room)},
               {"transmitter", numberToJson(report.origin.transmitter)},
               {"sensor", numberToJson(report.origin.sensor)},
               {"jig_or_time", numberToJson(report.origin.jig_or_time)}}}};
  if (report.hotspot) {
    to["hotspot"] = {{"center_m", vectorToJson(report.hotspot->center_m)},
                     {"radius_m", numberToJson(report.hotspot->radius_m)},
                     {"sd_m", numberToJson(report.hotspot->sd_m)},
                     {"half_m", numberToJson(report.hotspot->half_m)}};
  }
  if (report.source_shape) to["source_shape"] = sourceShapeToJson(*report.source_shape);
  return to;
}

json shrinkageToJson(const Shrinkage& shrinkage) {
  return {{"before_mm", numberToJson(shrinkage.before_mm)},
          {"after_mm", numberToJson(shrinkage.after_mm)},
          {"fraction", numberToJson(shrinkage.fraction)},
          {"low90", numberToJson(shrinkage.low90)},
          {"high90", numberToJson(shrinkage.high90)}};
}

/// @param order the names as they are to be shown: a JSON object keeps none
json parametersToJson(const std::vector<Estimate>& parameters, json& order) {
  json to = json::object();
  order = json::array();
  for (const Estimate& parameter : parameters) {
    to[parameter.name] = {{"value", numberToJson(parameter.value)},
                          {"unit", parameter.unit},
                          {"low90", numberToJson(parameter.low90)},
                          {"high90", numberToJson(parameter.high90)}};
    order.push_back(parameter.name);
  }
  return to;
}

json candidateToJson(const GapCandidate& candidate) {
  json to = {{"effect", candidate.effect},
             {"class", candidate.equivalents},
             {"probability", numberToJson(candidate.probability)},
             {"bic_gain", numberToJson(candidate.bic_gain)},
             {"location_m", candidate.location_m ? vectorToJson(*candidate.location_m) : json(nullptr)},
             {"location_covariance_m2",
              candidate.location_covariance_m2 ? matrixToJson(*candidate.location_covariance_m2) : json(nullptr)},
             {"material", candidate.material ? json(*candidate.material) : json(nullptr)},
             {"shrinkage", shrinkageToJson(candidate.shrinkage)},
             {"plausible", candidate.is_plausible},
             {"doubt", candidate.doubt},
             {"scene_parameters", candidate.scene_parameters}};
  to["parameters"] = parametersToJson(candidate.parameters, to["parameter_order"]);
  return to;
}

json selectedToJson(const SelectedEffect& selected) {
  json to = candidateToJson(selected);
  to["credit_fraction"] = numberToJson(selected.credit_fraction);
  to["excess2_before_mm2"] = numberToJson(selected.excess2_before_mm2);
  to["excess2_after_mm2"] = numberToJson(selected.excess2_after_mm2);
  return to;
}

json stepToJson(const GapStep& step) {
  return {{"effect", step.effect},
          {"excess_mm", numberToJson(step.excess_mm)},
          {"low90_mm", numberToJson(step.low90_mm)},
          {"high90_mm", numberToJson(step.high90_mm)},
          {"excess_deg", numberToJson(step.excess_deg)},
          {"low90_deg", numberToJson(step.low90_deg)},
          {"high90_deg", numberToJson(step.high90_deg)}};
}

json remainingToJson(const Remaining& remaining) {
  return {{"position_rms_mm", numberToJson(remaining.position_rms_mm)},
          {"fraction_of_start", numberToJson(remaining.fraction)},
          {"fraction_low90", numberToJson(remaining.low90)},
          {"fraction_high90", numberToJson(remaining.high90)},
          {"of", remaining.is_of_rotation ? "rotation" : "position"},
          {"excess2_before_mm2", numberToJson(remaining.excess2_before_mm2)},
          {"excess2_after_mm2", numberToJson(remaining.excess2_after_mm2)},
          {"p50_mm", numberToJson(remaining.p50_mm)},
          {"p90_mm", numberToJson(remaining.p90_mm)},
          {"p95_mm", numberToJson(remaining.p95_mm)},
          {"worst_mm", numberToJson(remaining.worst_mm)},
          {"worst_node", remaining.worst_node},
          {"where", remaining.where}};
}

json rivalToJson(const RivalReport& rival) {
  return {{"nats_over_unnamed", numberToJson(rival.nats_over_unnamed)},
          {"unnamed_nats", numberToJson(rival.unnamed_nats)},
          {"unseen_gain", numberToJson(rival.unseen_gain)},
          {"unseen_gain_low90", numberToJson(rival.unseen_gain_low90)},
          {"named_share", numberToJson(rival.named_share)},
          {"refused", rival.refused},
          {"why", rival.why}};
}

json replicatesToJson(const Replicates& replicates) {
  json to = {{"n", replicates.n},
             {"named_right", replicates.named_right},
             {"within_m_median", numberToJson(replicates.within_m_median)},
             {"runner_up", nullptr},
             {"text", replicates.text}};
  if (replicates.runner_up.empty()) return to;
  to["runner_up"] = {{"effect", replicates.runner_up},
                     {"n", replicates.runner_up_n},
                     {"named_right", replicates.runner_up_named_right},
                     {"named_as_this", replicates.runner_up_named_as_this}};
  return to;
}

json againstToJson(const Against& against) {
  return {{"changed", against.changed},
          {"p_value", numberToJson(against.p_value)},
          {"rms_mm", numberToJson(against.rms_mm)},
          {"location_m", against.location_m ? vectorToJson(*against.location_m) : json(nullptr)},
          {"effect", against.effect.empty() ? json(nullptr) : json(against.effect)}};
}

json predictionToJson(const Prediction& prediction) {
  return {{"effect", prediction.effect},
          {"selected", prediction.selected},
          {"node", prediction.node},
          {"now_mm", numberToJson(prediction.now_mm)},
          {"then_mm", numberToJson(prediction.then_mm)},
          {"then_sd_mm", numberToJson(prediction.then_sd_mm)}};
}

json detectableToJson(const SmallestDetectable& smallest) {
  return {{"effect", smallest.effect},
          {"parameter", smallest.parameter},
          {"value", numberToJson(smallest.value)},
          {"unit", smallest.unit}};
}

json findingToJson(const recording::GapFinding& finding) {
  return {{"effect", finding.effect}, {"text", finding.text}, {"nodes", finding.nodes}};
}

}  // namespace

json toJson(const Isolability& isolability) {
  return {{"pairs", listToJson(isolability.pairs,
                               [](const IsolabilityPair& pair) -> json {
                                 return {{"a", pair.a},
                                         {"b", pair.b},
                                         {"r2", numberToJson(pair.r2)},
                                         {"told_apart_from", numberToJson(pair.told_apart_from)}};
                               })},
          {"warnings", isolability.warnings}};
}

json toJson(const GapReport& report) {
  return {{"schema", "fieldtrue.gap/1"},
          {"software", std::string("Fieldtrue ") + FIELDTRUE_VERSION},
          {"input", inputToJson(report.input)},
          {"alignment",
           {{"tracker_from_reference", poseToJson(report.tracker_from_reference)},
            {"sensor_mount", poseToJson(report.sensor_from_mount)},
            {"sensor_mounts", mountsToJson(report.sensors_from_mounts)}}},
          {"verdict", std::string(idOf(report.verdict))},
          {"text", report.text},
          {"smallest_detectable", listToJson(report.smallest_detectable, detectableToJson)},
          {"gap", gapToJson(report)},
          {"where", whereToJson(report)},
          {"findings", listToJson(report.findings, findingToJson)},
          {"candidates", listToJson(report.candidates, candidateToJson)},
          {"selected", listToJson(report.selected, selectedToJson)},
          {"sequence", listToJson(report.sequence, stepToJson)},
          {"remaining", remainingToJson(report.remaining)},
          {"rival", rivalToJson(report.rival)},
          {"odds_over_next", numberToJson(report.odds_over_next)},
          {"not_looked_for", report.not_looked_for},
          {"replicates", report.replicates ? replicatesToJson(*report.replicates) : json(nullptr)},
          {"against", report.against ? againstToJson(*report.against) : json(nullptr)},
          {"isolability", toJson(report.isolability)},
          {"next_measurement", {{"text", report.next_measurement}, {"separates", report.next_separates}}},
          {"predictions", listToJson(report.predictions, predictionToJson)}};
}

Result<void> writeGapReport(const std::filesystem::path& path, const GapReport& report) {
  return writeFileAtomically(path, [&](std::ostream& out) { out << toJson(report).dump(1) << '\n'; });
}

}  // namespace fieldtrue::gap
