#include "calib/gap/report_reader.h"

#include <numbers>

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
Eigen::Vector3d vectorFrom(const JsonReader& json) {
  const std::vector<double> components = json.list([](const JsonReader& entry) { return entry.numberOrNan(); });
  if (components.size() != 3) json.refuse("a list of 3 numbers");
  return Eigen::Vector3d(components.data());
}

GapVerdict verdictFrom(const JsonReader& json) {
  std::vector<std::string> known;
  for (const GapVerdict verdict :
       {GapVerdict::kNoGap, GapVerdict::kExplained, GapVerdict::kPartlyExplained, GapVerdict::kUnexplained}) {
    if (json.raw() == idOf(verdict)) return verdict;
    known.emplace_back(idOf(verdict));
  }
  json.oneOf(known);
  return GapVerdict::kUnexplained;
}

GapReport::Input inputFrom(const JsonReader& json) {
  GapReport::Input input;
  input.places = json["places"].integer();
  input.rows = json["rows"].integer();
  input.samples = json["samples"].integer();
  input.orientations = json["orientations"].integer();
  input.position_only = json["position_only"].flag();
  return input;
}

Eigen::Vector3d turnFrom(const JsonReader& json) {
  if (json.isNull()) return Eigen::Vector3d::Zero();
  return kRadPerDeg * vectorFrom(json);
}

GapNode nodeFrom(const JsonReader& json) {
  GapNode node;
  node.node = json["node"].integer();
  node.visit = json["visit"].integer();
  node.place_m = vectorFrom(json["place_m"]);
  node.before_m = kMPerMm * vectorFrom(json["before_mm"]);
  node.after_m = kMPerMm * vectorFrom(json["after_mm"]);
  node.before_rad = turnFrom(json["before_deg"]);
  node.after_rad = turnFrom(json["after_deg"]);
  node.excess = json["excess"].numberOrNan();
  node.is_flagged = json["flagged"].flag();
  return node;
}

std::vector<GapBin> binsFrom(const JsonReader& json, const char* low_key, const char* high_key) {
  return json.list([&](const JsonReader& bin) {
    return GapBin{bin[low_key].numberOrNan(), bin[high_key].numberOrNan(), bin["rms_mm"].numberOrNan(),
                  bin["floor_mm"].numberOrNan()};
  });
}

void readWhere(const JsonReader& json, GapReport& report) {
  report.nodes = json["nodes"].list(nodeFrom);
  const JsonReader hotspot = json["hotspot"];
  if (!hotspot.isNull()) report.hotspot = Hotspot{vectorFrom(hotspot["center_m"]), hotspot["radius_m"].numberOrNan()};
  report.channels = json["channels"].list([](const JsonReader& channel) {
    return GapChannel{channel["name"].text(), channel["unit"].text(), channel["rms"].numberOrNan(),
                      channel["floor"].numberOrNan()};
  });
  report.by_range = binsFrom(json["by_range"], "low_m", "high_m");
  report.by_layer = binsFrom(json["by_layer"], "layer", "layer");
  report.by_time = binsFrom(json["by_time"], "t_start_s", "t_end_s");
  const JsonReader origin = json["origin"];
  report.origin = {origin["room"].numberOrNan(), origin["transmitter"].numberOrNan(), origin["sensor"].numberOrNan(),
                   origin["jig_or_time"].numberOrNan()};
}

void readGap(const JsonReader& json, GapReport& report) {
  report.position_rms_mm = json["position_rms_mm"].numberOrNan();
  report.orientation_rms_deg = json["orientation_rms_deg"].optionalNumber();
  report.floor_position_mm = json["floor_position_mm"].numberOrNan();
  report.floor_orientation_deg = json["floor_orientation_deg"].optionalNumber();
  report.ratio_to_floor = json["ratio_to_floor"].numberOrNan();
  report.p_value = json["p_value"].numberOrNan();
}

Shrinkage shrinkageFrom(const JsonReader& json) {
  return {json["before_mm"].numberOrNan(), json["after_mm"].numberOrNan(), json["fraction"].numberOrNan(),
          json["low90"].optionalNumber(), json["high90"].optionalNumber()};
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

void readCandidate(const JsonReader& json, GapCandidate& candidate) {
  candidate.effect = json["effect"].text();
  candidate.equivalents = json["class"].texts();
  candidate.probability = json["probability"].numberOrNan();
  candidate.bic_gain = json["bic_gain"].numberOrNan();
  candidate.parameters = parametersFrom(json);
  if (const JsonReader location = json["location_m"]; !location.isNull()) candidate.location_m = vectorFrom(location);
  if (const JsonReader covariance = json["location_covariance_m2"]; !covariance.isNull())
    candidate.location_covariance_m2 = covariance.matrix3();
  candidate.material = json["material"].optionalText();
  candidate.shrinkage = shrinkageFrom(json["shrinkage"]);
  candidate.is_plausible = json["plausible"].flag();
  candidate.doubt = json["doubt"].text();
  candidate.scene_parameters = json["scene_parameters"].raw();
}

GapCandidate candidateFrom(const JsonReader& json) {
  GapCandidate candidate;
  readCandidate(json, candidate);
  return candidate;
}

SelectedEffect selectedFrom(const JsonReader& json) {
  SelectedEffect selected;
  readCandidate(json, selected);
  selected.credit_fraction = json["credit_fraction"].numberOrNan();
  return selected;
}

void readLists(const JsonReader& json, GapReport& report) {
  report.smallest_detectable = json["smallest_detectable"].list([](const JsonReader& item) {
    return SmallestDetectable{item["effect"].text(), item["parameter"].text(), item["value"].numberOrNan(),
                              item["unit"].text()};
  });
  report.findings = json["findings"].list([](const JsonReader& item) {
    return recording::GapFinding{item["effect"].text(), item["text"].text(), item["nodes"].integers()};
  });
  report.candidates = json["candidates"].list(candidateFrom);
  report.selected = json["selected"].list(selectedFrom);
  report.sequence = json["sequence"].list([](const JsonReader& item) {
    return GapStep{item["effect"].text(), item["excess_mm"].numberOrNan(), item["low90_mm"].optionalNumber(),
                   item["high90_mm"].optionalNumber()};
  });
  report.predictions = json["predictions"].list([](const JsonReader& item) {
    return Prediction{item["effect"].text(), item["node"].integer(), item["now_mm"].numberOrNan(),
                      item["then_mm"].numberOrNan(), item["then_sd_mm"].numberOrNan()};
  });
}

void readRemaining(const JsonReader& json, GapReport& report) {
  report.remaining_position_rms_mm = json["position_rms_mm"].numberOrNan();
  report.remaining_fraction = json["fraction_of_start"].numberOrNan();
  report.remaining_where = json["where"].integers();
}

Isolability isolabilityFrom(const JsonReader& json) {
  Isolability isolability;
  isolability.pairs = json["pairs"].list([](const JsonReader& pair) {
    return IsolabilityPair{pair["a"].text(), pair["b"].text(), pair["r2"].numberOrNan()};
  });
  isolability.warnings = json["warnings"].texts();
  return isolability;
}

GapReport reportFrom(const JsonReader& root) {
  if (!root.schema("fieldtrue.gap/", kVersion, "a gap report"))
    root.fail("is not a gap report; it needs the key schema with \"fieldtrue.gap/" + std::to_string(kVersion) + "\".");
  GapReport report;
  report.input = inputFrom(root["input"]);
  report.tracker_from_reference = root["alignment"]["tracker_from_reference"].pose();
  report.sensor_from_mount = root["alignment"]["sensor_mount"].pose();
  report.verdict = verdictFrom(root["verdict"]);
  report.text = root["text"].text();
  readGap(root["gap"], report);
  readWhere(root["where"], report);
  readLists(root, report);
  readRemaining(root["remaining"], report);
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
