#include "calib/gap/report_reader.h"

#include <algorithm>

#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"
#include "calib/core/units.h"
#include "calib/gap/report_json.h"
#include "calib/recording/finding.h"

namespace fieldtrue::gap {

namespace {

constexpr int kVersion = 1;

/// Components that could not be estimated are null.
Eigen::Vector3d vectorFrom(const JsonReader& reader) {
  const std::vector<double> components = reader.list([](const JsonReader& entry) { return entry.numberOrNan(); });
  if (components.size() != 3) reader.refuse("a list of 3 numbers");
  return Eigen::Vector3d(components.data());
}

GapVerdict verdictFrom(const JsonReader& reader) {
  std::vector<std::string> known;
  for (const GapVerdict verdict :
       {GapVerdict::kNoGap, GapVerdict::kExplained, GapVerdict::kPartlyExplained, GapVerdict::kUnexplained}) {
    if (reader.raw() == idOf(verdict)) return verdict;
    known.emplace_back(idOf(verdict));
  }
  reader.oneOf(known);
  return GapVerdict::kUnexplained;
}

GapReport::Input inputFrom(const JsonReader& reader) {
  GapReport::Input input;
  input.places = reader["places"].integer();
  input.rows = reader["rows"].integer();
  input.samples = reader["samples"].integer();
  input.orientations = reader["orientations"].integer();
  input.position_only = reader["position_only"].flag();
  return input;
}

Eigen::Vector3d turnFrom(const JsonReader& reader) {
  if (reader.isNull()) return Eigen::Vector3d::Zero();
  return kRadPerDeg * vectorFrom(reader);
}

GapNode nodeFrom(const JsonReader& reader) {
  GapNode node;
  node.node = reader["node"].integer();
  node.visit = reader["visit"].integer();
  if (const auto sensor = reader.find("sensor")) node.sensor = sensor->integer();
  node.place_m = vectorFrom(reader["place_m"]);
  node.before_m = kMPerMm * vectorFrom(reader["before_mm"]);
  node.after_m = kMPerMm * vectorFrom(reader["after_mm"]);
  node.before_rad = turnFrom(reader["before_deg"]);
  node.after_rad = turnFrom(reader["after_deg"]);
  node.excess = reader["excess"].numberOrNan();
  node.is_flagged = reader["flagged"].flag();
  return node;
}

std::vector<GapBin> binsFrom(const JsonReader& reader, const char* low_key, const char* high_key) {
  return reader.list([&](const JsonReader& bin) {
    return GapBin{bin[low_key].numberOrNan(), bin[high_key].numberOrNan(), bin["rms_mm"].numberOrNan(),
                  bin["floor_mm"].numberOrNan()};
  });
}

SourceShape sourceShapeFrom(const JsonReader& reader) {
  SourceShape shape;
  const std::string id = reader["shape"].text();
  for (const Shape one : kShapes)
    if (id == idOf(one)) shape.shape = one;
  shape.center_m = vectorFrom(reader["center_m"]);
  shape.values_m3 = vectorFrom(reader["polarizabilities_m3"]);
  shape.sds_m3 = vectorFrom(reader["sd_m3"]);
  int k = 0;
  for (const Eigen::Vector3d& axis : reader["axes"].list(vectorFrom))
    if (k < 3) shape.axes.col(k++) = axis;
  return shape;
}

void readWhere(const JsonReader& reader, GapReport& report) {
  report.nodes = reader["nodes"].list(nodeFrom);
  const JsonReader hotspot = reader["hotspot"];
  if (!hotspot.isNull()) {
    const auto ifTold = [&](const char* key) {
      const auto found = hotspot.find(key);
      return found ? found->optionalNumber() : std::nullopt;
    };
    report.hotspot =
        Hotspot{vectorFrom(hotspot["center_m"]), hotspot["radius_m"].numberOrNan(), ifTold("sd_m"), ifTold("half_m")};
  }
  if (const auto shape = reader.find("source_shape"); shape && !shape->isNull())
    report.source_shape = sourceShapeFrom(*shape);
  report.channels = reader["channels"].list([](const JsonReader& channel) {
    return GapChannel{channel["name"].text(), channel["unit"].text(), channel["rms"].numberOrNan(),
                      channel["floor"].numberOrNan()};
  });
  report.by_range = binsFrom(reader["by_range"], "low_m", "high_m");
  report.by_layer = binsFrom(reader["by_layer"], "layer", "layer");
  report.by_time = binsFrom(reader["by_time"], "t_start_s", "t_end_s");
  const JsonReader origin = reader["origin"];
  report.origin = {origin["room"].numberOrNan(), origin["transmitter"].numberOrNan(), origin["sensor"].numberOrNan(),
                   origin["jig_or_time"].numberOrNan()};
}

void readGap(const JsonReader& reader, GapReport& report) {
  report.position_rms_mm = reader["position_rms_mm"].numberOrNan();
  report.orientation_rms_deg = reader["orientation_rms_deg"].optionalNumber();
  report.floor_position_mm = reader["floor_position_mm"].numberOrNan();
  report.floor_orientation_deg = reader["floor_orientation_deg"].optionalNumber();
  report.ratio_to_floor = reader["ratio_to_floor"].numberOrNan();
  report.p_value = reader["p_value"].numberOrNan();
}

Shrinkage shrinkageFrom(const JsonReader& reader) {
  return {reader["before_mm"].numberOrNan(), reader["after_mm"].numberOrNan(), reader["fraction"].numberOrNan(),
          reader["low90"].optionalNumber(), reader["high90"].optionalNumber()};
}

std::vector<Estimate> parametersFrom(const JsonReader& candidate) {
  const JsonReader parameters = candidate["parameters"];
  std::vector<Estimate> estimates;
  for (const std::string& name : candidate["parameter_order"].texts()) {
    const JsonReader parameter = parameters[name.c_str()];
    estimates.push_back({name, parameter["unit"].text(), parameter["value"].numberOrNan(),
                         parameter["low90"].optionalNumber(), parameter["high90"].optionalNumber()});
  }
  return estimates;
}

void readCandidate(const JsonReader& reader, GapCandidate& candidate) {
  candidate.effect = reader["effect"].text();
  candidate.equivalents = reader["class"].texts();
  candidate.probability = reader["probability"].numberOrNan();
  candidate.bic_gain = reader["bic_gain"].numberOrNan();
  candidate.parameters = parametersFrom(reader);
  if (const JsonReader location = reader["location_m"]; !location.isNull()) candidate.location_m = vectorFrom(location);
  if (const JsonReader covariance = reader["location_covariance_m2"]; !covariance.isNull())
    candidate.location_covariance_m2 = covariance.matrix3();
  candidate.material = reader["material"].optionalText();
  candidate.shrinkage = shrinkageFrom(reader["shrinkage"]);
  candidate.is_plausible = reader["plausible"].flag();
  candidate.doubt = reader["doubt"].text();
  candidate.scene_parameters = reader["scene_parameters"].raw();
}

GapCandidate candidateFrom(const JsonReader& reader) {
  GapCandidate candidate;
  readCandidate(reader, candidate);
  return candidate;
}

SelectedEffect selectedFrom(const JsonReader& reader) {
  SelectedEffect selected;
  readCandidate(reader, selected);
  selected.credit_fraction = reader["credit_fraction"].numberOrNan();
  if (!reader.has("excess2_before_mm2")) return selected;  // Written before these were there.
  selected.excess2_before_mm2 = reader["excess2_before_mm2"].numberOrNan();
  selected.excess2_after_mm2 = reader["excess2_after_mm2"].numberOrNan();
  return selected;
}

void readLists(const JsonReader& reader, GapReport& report) {
  report.smallest_detectable = reader["smallest_detectable"].list([](const JsonReader& item) {
    return SmallestDetectable{item["effect"].text(), item["parameter"].text(), item["value"].numberOrNan(),
                              item["unit"].text()};
  });
  report.findings = reader["findings"].list([](const JsonReader& item) {
    return recording::GapFinding{item["effect"].text(), item["text"].text(), item["nodes"].integers()};
  });
  report.candidates = reader["candidates"].list(candidateFrom);
  report.selected = reader["selected"].list(selectedFrom);
  report.sequence = reader["sequence"].list([](const JsonReader& item) {
    GapStep step{item["effect"].text(), item["excess_mm"].numberOrNan(), item["low90_mm"].optionalNumber(),
                 item["high90_mm"].optionalNumber()};
    if (!item.has("excess_deg")) return step;  // Written before these were told.
    step.excess_deg = item["excess_deg"].optionalNumber();
    step.low90_deg = item["low90_deg"].optionalNumber();
    step.high90_deg = item["high90_deg"].optionalNumber();
    return step;
  });
  report.predictions = reader["predictions"].list([](const JsonReader& item) {
    const int selected = item.has("selected") ? item["selected"].integer() : 0;
    return Prediction{item["effect"].text(),         static_cast<std::size_t>(std::max(0, selected)),
                      item["node"].integer(),        item["now_mm"].numberOrNan(),
                      item["then_mm"].numberOrNan(), item["then_sd_mm"].numberOrNan()};
  });
}

void readRemaining(const JsonReader& reader, GapReport& report) {
  Remaining& remaining = report.remaining;
  remaining.position_rms_mm = reader["position_rms_mm"].numberOrNan();
  remaining.fraction = reader["fraction_of_start"].numberOrNan();
  remaining.where = reader["where"].integers();
  if (!reader.has("fraction_low90")) return;  // Written before these were there.
  remaining.low90 = reader["fraction_low90"].optionalNumber();
  remaining.high90 = reader["fraction_high90"].optionalNumber();
  remaining.is_of_rotation = reader["of"].oneOf({"position", "rotation"}) == "rotation";
  remaining.excess2_before_mm2 = reader["excess2_before_mm2"].numberOrNan();
  remaining.excess2_after_mm2 = reader["excess2_after_mm2"].numberOrNan();
  remaining.p50_mm = reader["p50_mm"].numberOrNan();
  remaining.p90_mm = reader["p90_mm"].numberOrNan();
  remaining.p95_mm = reader["p95_mm"].numberOrNan();
  remaining.worst_mm = reader["worst_mm"].numberOrNan();
  remaining.worst_node = reader["worst_node"].integer();
}

void readRival(const JsonReader& reader, RivalReport& rival) {
  rival.nats_over_unnamed = reader["nats_over_unnamed"].numberOrNan();
  rival.unnamed_nats = reader["unnamed_nats"].numberOrNan();
  rival.unseen_gain = reader["unseen_gain"].numberOrNan();
  rival.unseen_gain_low90 = reader["unseen_gain_low90"].optionalNumber();
  rival.named_share = reader["named_share"].numberOrNan();
  rival.refused = reader["refused"].texts();
  rival.why = reader["why"].text();
}

Replicates replicatesFrom(const JsonReader& reader) {
  Replicates replicates;
  replicates.n = reader["n"].integer();
  replicates.named_right = reader["named_right"].integer();
  replicates.within_m_median = reader["within_m_median"].optionalNumber();
  replicates.text = reader["text"].text();
  const JsonReader other = reader["runner_up"];
  if (other.isNull()) return replicates;
  replicates.runner_up = other["effect"].text();
  replicates.runner_up_n = other["n"].integer();
  replicates.runner_up_named_right = other["named_right"].integer();
  replicates.runner_up_named_as_this = other["named_as_this"].integer();
  return replicates;
}

Against againstFrom(const JsonReader& reader) {
  Against against;
  against.changed = reader["changed"].flag();
  against.p_value = reader["p_value"].number();
  against.rms_mm = reader["rms_mm"].number();
  if (const JsonReader location = reader["location_m"]; !location.isNull()) against.location_m = location.vector3();
  if (!reader["effect"].isNull()) against.effect = reader["effect"].text();
  return against;
}

Isolability isolabilityFrom(const JsonReader& reader) {
  Isolability isolability;
  isolability.pairs = reader["pairs"].list([](const JsonReader& pair) {
    IsolabilityPair read{pair["a"].text(), pair["b"].text(), pair["r2"].numberOrNan(), {}};
    if (const auto from = pair.find("told_apart_from")) read.told_apart_from = from->optionalNumber();
    return read;
  });
  isolability.warnings = reader["warnings"].texts();
  return isolability;
}

GapReport reportFrom(const JsonReader& root) {
  if (!root.schema("fieldtrue.gap/", kVersion, "a gap report"))
    root.fail("is not a gap report; it needs the key schema with \"fieldtrue.gap/" + std::to_string(kVersion) + "\".");
  GapReport report;
  report.input = inputFrom(root["input"]);
  report.tracker_from_reference = root["alignment"]["tracker_from_reference"].pose();
  report.sensor_from_mount = root["alignment"]["sensor_mount"].pose();
  if (const auto mounts = root["alignment"].find("sensor_mounts")) {
    for (const JsonReader& mount : mounts->entries())
      report.sensors_from_mounts[mount["sensor"].integer()] = mount.pose();
  }
  report.verdict = verdictFrom(root["verdict"]);
  report.text = root["text"].text();
  readGap(root["gap"], report);
  readWhere(root["where"], report);
  readLists(root, report);
  readRemaining(root["remaining"], report);
  if (root.has("rival")) readRival(root["rival"], report.rival);
  if (const auto replicates = root.find("replicates"); replicates && !replicates->isNull())
    report.replicates = replicatesFrom(*replicates);
  if (const auto against = root.find("against"); against && !against->isNull()) report.against = againstFrom(*against);
  if (root.has("not_looked_for")) report.not_looked_for = root["not_looked_for"].text();
  if (root.has("odds_over_next")) report.odds_over_next = root["odds_over_next"].optionalNumber();
  report.isolability = isolabilityFrom(root["isolability"]);
  report.next_measurement = root["next_measurement"]["text"].text();
  report.next_separates = root["next_measurement"]["separates"].texts();
  return report;
}

}  // namespace

Result<GapReport> readGapReport(const nlohmann::json& document, const std::string& name) {
  return readJson<GapReport>(document, name, reportFrom);
}

Result<GapReport> readGapReport(const std::filesystem::path& path) {
  FT_TRY(const std::string text, readFile(path));
  const std::string name = path.filename().string();
  FT_TRY(const nlohmann::json document, parseJson(text, name));
  return readGapReport(document, name);
}

}  // namespace fieldtrue::gap
