#include "calib/gap/json_reader.h"

#include <array>
#include <charconv>
#include <numbers>
#include <string_view>

#include "calib/core/file_io.h"
#include "calib/gap/json.h"
#include "calib/gap/json_cursor.h"
#include "calib/recording/finding.h"
#include "calib/tables/json_text.h"

namespace fieldtrue::gap {

namespace {

using nlohmann::json;

constexpr std::string_view kSchema = "fieldtrue.gap/";
constexpr int kVersion = 1;
constexpr double kMPerMm = 1e-3;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;

Result<void> checkSchema(const json& document, const std::string& name) {
  const std::string known = std::string(kSchema) + std::to_string(kVersion);
  const auto found = document.is_object() ? document.find("schema") : document.end();
  if (!document.is_object() || found == document.end()) {
    return fail(ErrorCode::kBadInput, name + " is not a gap report; it needs the key schema with \"" + known + "\".");
  }
  const std::string schema = found->is_string() ? found->get<std::string>() : std::string();
  int version = 0;
  if (schema.starts_with(kSchema)) {
    std::from_chars(schema.data() + kSchema.size(), schema.data() + schema.size(), version);
  }
  if (version > kVersion) {
    return fail(ErrorCode::kNewerVersion, name + ": schema is \"" + schema +
                                              "\", written by a newer version of Fieldtrue; this one reads " + known +
                                              ".");
  }
  if (schema == known) return {};
  return fail(ErrorCode::kBadInput,
              name + ": schema is " + effects::seenValue(*found) + "; a gap report has \"" + known + "\".");
}

Pose poseFrom(const JsonCursor& cursor) {
  Pose pose;
  pose.position_m = cursor["t_m"].vector3();
  const JsonCursor quaternion = cursor["q_wxyz"];
  const std::vector<double> q = quaternion.list([](const JsonCursor& component) { return component.number(); });
  if (q.size() != 4) {
    quaternion.refuse("a list of 4 numbers");
  } else {
    pose.orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  }
  return pose;
}

GapVerdict verdictFrom(const JsonCursor& cursor) {
  const std::string id = cursor.text();
  std::string known;
  for (const GapVerdict verdict :
       {GapVerdict::kNoGap, GapVerdict::kExplained, GapVerdict::kPartlyExplained, GapVerdict::kUnexplained}) {
    if (idOf(verdict) == id) return verdict;
    known += (known.empty() ? "" : ", ") + std::string(idOf(verdict));
  }
  cursor.refuse("one of " + known);
  return GapVerdict::kUnexplained;
}

GapReport::Input inputFrom(const JsonCursor& cursor) {
  GapReport::Input input;
  input.places = cursor["places"].integer();
  input.rows = cursor["rows"].integer();
  input.samples = cursor["samples"].integer();
  input.orientations = cursor["orientations"].integer();
  input.position_only = cursor["position_only"].flag();
  return input;
}

Eigen::Vector3d turnFrom(const JsonCursor& cursor) {
  if (cursor.isNull()) return Eigen::Vector3d::Zero();
  return cursor.vector3(kRadPerDeg);
}

GapNode nodeFrom(const JsonCursor& cursor) {
  GapNode node;
  node.node = cursor["node"].integer();
  node.visit = cursor["visit"].integer();
  node.place_m = cursor["place_m"].vector3();
  node.before_m = cursor["before_mm"].vector3(kMPerMm);
  node.after_m = cursor["after_mm"].vector3(kMPerMm);
  node.before_rad = turnFrom(cursor["before_deg"]);
  node.after_rad = turnFrom(cursor["after_deg"]);
  node.excess = cursor["excess"].number();
  node.is_flagged = cursor["flagged"].flag();
  return node;
}

std::vector<GapBin> binsFrom(const JsonCursor& cursor, const char* low_key, const char* high_key) {
  return cursor.list([&](const JsonCursor& bin) {
    return GapBin{bin[low_key].number(), bin[high_key].number(), bin["rms_mm"].number(), bin["floor_mm"].number()};
  });
}

void readWhere(const JsonCursor& cursor, GapReport& report) {
  report.nodes = cursor["nodes"].list(nodeFrom);
  const JsonCursor hotspot = cursor["hotspot"];
  if (!hotspot.isNull()) report.hotspot = Hotspot{hotspot["center_m"].vector3(), hotspot["radius_m"].number()};
  report.channels = cursor["channels"].list([](const JsonCursor& channel) {
    return GapChannel{channel["name"].text(), channel["unit"].text(), channel["rms"].number(),
                      channel["floor"].number()};
  });
  report.by_range = binsFrom(cursor["by_range"], "low_m", "high_m");
  report.by_layer = binsFrom(cursor["by_layer"], "layer", "layer");
  report.by_time = binsFrom(cursor["by_time"], "t_start_s", "t_end_s");
  const JsonCursor origin = cursor["origin"];
  report.origin = {origin["room"].number(), origin["transmitter"].number(), origin["sensor"].number(),
                   origin["jig_or_time"].number()};
}

void readGap(const JsonCursor& cursor, GapReport& report) {
  report.position_rms_mm = cursor["position_rms_mm"].number();
  report.orientation_rms_deg = cursor["orientation_rms_deg"].optionalNumber();
  report.floor_position_mm = cursor["floor_position_mm"].number();
  report.floor_orientation_deg = cursor["floor_orientation_deg"].optionalNumber();
  report.ratio_to_floor = cursor["ratio_to_floor"].number();
  report.p_value = cursor["p_value"].number();
}

Shrinkage shrinkageFrom(const JsonCursor& cursor) {
  return {cursor["before_mm"].number(), cursor["after_mm"].number(), cursor["fraction"].number(),
          cursor["low90"].optionalNumber(), cursor["high90"].optionalNumber()};
}

std::vector<Estimate> parametersFrom(const JsonCursor& candidate) {
  const JsonCursor parameters = candidate["parameters"];
  std::vector<Estimate> estimates;
  for (const std::string& name : candidate["parameter_order"].texts()) {
    const JsonCursor parameter = parameters[name.c_str()];
    estimates.push_back({name, parameter["unit"].text(), parameter["value"].number(),
                         parameter["low90"].optionalNumber(), parameter["high90"].optionalNumber()});
  }
  return estimates;
}

std::optional<Eigen::Matrix3d> matrixFrom(const JsonCursor& cursor) {
  if (cursor.isNull()) return std::nullopt;
  const auto rows = cursor.list([](const JsonCursor& row) { return row.vector3(); });
  if (rows.size() != 3) {
    cursor.refuse("a list of 3 rows");
    return std::nullopt;
  }
  Eigen::Matrix3d matrix;
  for (int row = 0; row < 3; ++row) matrix.row(row) = rows[static_cast<std::size_t>(row)].transpose();
  return matrix;
}

void readCandidate(const JsonCursor& cursor, GapCandidate& candidate) {
  candidate.effect = cursor["effect"].text();
  candidate.equivalents = cursor["class"].texts();
  candidate.probability = cursor["probability"].number();
  candidate.bic_gain = cursor["bic_gain"].number();
  candidate.parameters = parametersFrom(cursor);
  if (!cursor["location_m"].isNull()) candidate.location_m = cursor["location_m"].vector3();
  candidate.location_covariance_m2 = matrixFrom(cursor["location_covariance_m2"]);
  candidate.material = cursor["material"].optionalText();
  candidate.shrinkage = shrinkageFrom(cursor["shrinkage"]);
  candidate.is_plausible = cursor["plausible"].flag();
  candidate.doubt = cursor["doubt"].text();
  candidate.scene_parameters = cursor["scene_parameters"].raw();
}

GapCandidate candidateFrom(const JsonCursor& cursor) {
  GapCandidate candidate;
  readCandidate(cursor, candidate);
  return candidate;
}

SelectedEffect selectedFrom(const JsonCursor& cursor) {
  SelectedEffect selected;
  readCandidate(cursor, selected);
  selected.credit_fraction = cursor["credit_fraction"].number();
  return selected;
}

void readLists(const JsonCursor& cursor, GapReport& report) {
  report.smallest_detectable = cursor["smallest_detectable"].list([](const JsonCursor& item) {
    return SmallestDetectable{item["effect"].text(), item["parameter"].text(), item["value"].number(),
                              item["unit"].text()};
  });
  report.findings = cursor["findings"].list([](const JsonCursor& item) {
    return recording::GapFinding{item["effect"].text(), item["text"].text(), item["nodes"].integers()};
  });
  report.candidates = cursor["candidates"].list(candidateFrom);
  report.selected = cursor["selected"].list(selectedFrom);
  report.sequence = cursor["sequence"].list([](const JsonCursor& item) {
    return GapStep{item["effect"].text(), item["excess_mm"].number(), item["low90_mm"].optionalNumber(),
                   item["high90_mm"].optionalNumber()};
  });
  report.predictions = cursor["predictions"].list([](const JsonCursor& item) {
    return Prediction{item["effect"].text(), item["node"].integer(), item["now_mm"].number(), item["then_mm"].number(),
                      item["then_sd_mm"].number()};
  });
}

void readRemaining(const JsonCursor& cursor, GapReport& report) {
  report.remaining_position_rms_mm = cursor["position_rms_mm"].number();
  report.remaining_fraction = cursor["fraction_of_start"].number();
  report.remaining_where = cursor["where"].integers();
}

Isolability isolabilityFrom(const JsonCursor& cursor) {
  Isolability isolability;
  isolability.pairs = cursor["pairs"].list([](const JsonCursor& pair) {
    return IsolabilityPair{pair["a"].text(), pair["b"].text(), pair["r2"].number()};
  });
  isolability.warnings = cursor["warnings"].texts();
  return isolability;
}

}  // namespace

Result<GapReport> readGapReport(const json& document, const std::string& name) {
  if (const Result<void> known = checkSchema(document, name); !known) return tl::unexpected<Error>(known.error());
  std::string problem;
  const JsonCursor root(document, problem);
  GapReport report;
  report.input = inputFrom(root["input"]);
  report.tracker_from_reference = poseFrom(root["alignment"]["tracker_from_reference"]);
  report.sensor_from_mount = poseFrom(root["alignment"]["sensor_mount"]);
  report.verdict = verdictFrom(root["verdict"]);
  report.text = root["text"].text();
  readGap(root["gap"], report);
  readWhere(root["where"], report);
  readLists(root, report);
  readRemaining(root["remaining"], report);
  report.isolability = isolabilityFrom(root["isolability"]);
  report.next_measurement = root["next_measurement"]["text"].text();
  report.next_separates = root["next_measurement"]["separates"].texts();
  if (!problem.empty()) return fail(ErrorCode::kBadInput, name + ": " + problem + ".");
  return report;
}

Result<GapReport> readGapReport(const std::filesystem::path& path) {
  const Result<std::string> text = readFile(path);
  if (!text) return tl::unexpected<Error>(text.error());
  const std::string name = path.filename().string();
  const Result<json> document = parseJson(*text, name);
  if (!document) return tl::unexpected<Error>(document.error());
  return readGapReport(*document, name);
}

}  // namespace fieldtrue::gap
