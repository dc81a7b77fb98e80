#include <array>
#include <cstdio>
#include <map>

#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/core/quantum.h"
#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/importers/averaging.h"
#include "calib/importers/rows.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {

namespace {

using Names = std::vector<std::string_view>;

const Names kPlaceColumns{"t_s", "landmark", "true_x_mm", "true_y_mm", "true_z_mm"};

/// Which columns hold the tracked pose of a body.
struct Body {
  std::string_view name;
  Names position;
  Names rotation;  ///< Empty: the table has no orientation of it.
  bool has_truth;
};
const std::array<Body, 3>& bodies() {
  static const std::array<Body, 3> table{
      {{"tip", {"tip_x_mm", "tip_y_mm", "tip_z_mm"}, {}, true},
       {"stylus",
        {"stylus_x_mm", "stylus_y_mm", "stylus_z_mm"},
        {"stylus_qw", "stylus_qx", "stylus_qy", "stylus_qz"},
        false},
       {"reference", {"ref_x_mm", "ref_y_mm", "ref_z_mm"}, {"ref_qw", "ref_qx", "ref_qy", "ref_qz"}, false}}};
  return table;
}

const Body& bodyNamed(const std::string& name) {
  for (const Body& body : bodies()) {
    if (body.name == name) return body;
  }
  FT_CHECK(false);
  return bodies()[0];
}

struct Recording {
  SampleTable samples;
  std::map<int, Eigen::Vector3d> true_m;  ///< Of each landmark.
};

Eigen::Vector3d position_m(CsvReader& reader, std::span<const std::size_t> columns) {
  const double x_mm = reader.number(columns[0]);
  const double y_mm = reader.number(columns[1]);
  const double z_mm = reader.number(columns[2]);
  return kMPerMm * Eigen::Vector3d(x_mm, y_mm, z_mm);
}

void readRow(CsvReader& reader, const std::vector<std::size_t>& place, const std::vector<std::size_t>& position,
             const std::optional<std::vector<std::size_t>>& rotation, Recording& recording) {
  SampleRow row;
  row.sample.time_s = reader.number(place[0]);
  const int landmark = reader.integer(place[1]);
  row.node = landmark > 0 ? landmark : -1;
  row.sample.tracker_from_sensor.position_m = position_m(reader, position);
  row.sample.tracker_from_sensor.orientation = reader.quaternion(rotation).value_or(Eigen::Quaterniond::Identity());
  markMissing(row.sample);
  if (landmark > 0) {
    const Eigen::Vector3d true_m = position_m(reader, std::span(place).subspan(2));
    const auto [known, is_new] = recording.true_m.emplace(landmark, true_m);
    if (!is_new && known->second != true_m) {
      reader.failAt(place[2], "landmark " + std::to_string(landmark) + " had another true position before");
    }
  }
  recording.samples.rows.push_back(std::move(row));
}

Result<Recording> readRecording(const std::filesystem::path& path, const Body& body) {
  FT_TRY(std::ifstream in, openForReading(path));
  FT_TRY(CsvReader reader, CsvReader::open(in, path.filename().string()));
  FT_TRY(const std::vector<std::size_t> place, reader.require(kPlaceColumns));
  FT_TRY(const std::vector<std::size_t> position, reader.require(body.position));
  std::optional<std::vector<std::size_t>> rotation;
  if (!body.rotation.empty()) {
    FT_TRY(const std::vector<std::size_t> found, reader.require(body.rotation));
    rotation = found;
  }
  Recording recording;
  while (true) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    readRow(reader, place, position, rotation, recording);
    if (reader.error()) return tl::unexpected(*reader.error());
  }
  if (recording.samples.rows.empty()) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no rows");
  return recording;
}

void describe(const Body& body, Recording& recording, std::vector<std::string>& notes) {
  TableMetadata& metadata = recording.samples.metadata;
  metadata.rig = "fCal 2.0 phantom, machined landmarks";
  metadata.other["body"] = body.name;
  const std::vector<SampleRow>& rows = recording.samples.rows;
  const double span_s = rows.back().sample.time_s - rows.front().sample.time_s;
  if (span_s > 0.0) metadata.rate_hz = static_cast<double>(rows.size() - 1) / span_s;
  std::vector<double> values_m;
  for (const SampleRow& row : rows) {
    const Eigen::Vector3d& p_m = row.sample.tracker_from_sensor.position_m;
    values_m.insert(values_m.end(), {p_m.x(), p_m.y(), p_m.z()});
  }
  metadata.quantum_m = findQuantum_m(values_m);
  if (!metadata.quantum_m) return;
  char text[96];
  std::snprintf(text, sizeof text, "Positions of the %s are multiples of %.5f mm", std::string(body.name).c_str(),
                *metadata.quantum_m * 1e3);
  notes.emplace_back(text);
}

Result<Import> importPlus(const std::filesystem::path& path, const std::optional<std::filesystem::path>&,
                          const Settings& settings) {
  const Body& body = bodyNamed(choiceSetting(settings, "body"));
  FT_TRY(Recording recording, readRecording(path, body));
  Import import;
  describe(body, recording, import.notes);
  if (body.has_truth && !recording.true_m.empty()) {
    AveragingOptions options;
    options.reject_outliers = boolSetting(settings, "reject");
    FT_TRY(AveragedNodes averaged, averageRows(recording.samples.rows, options, !body.rotation.empty(), "Landmark"));
    for (Node& node : averaged.nodes) node.reference_from_sensor.position_m = recording.true_m.at(node.node);
    import.notes.insert(import.notes.end(), averaged.notes.begin(), averaged.notes.end());
    import.table = CalibrationTable{recording.samples.metadata, std::move(averaged.nodes)};
  } else {
    import.notes.push_back("The table has no true positions of the " + std::string(body.name) + ": samples only");
  }
  import.samples = std::move(recording.samples);
  return import;
}

}  // namespace

/// The sample table of fCal (PLUS) recordings: a stylus pivoting on the landmarks of a phantom.
Importer plusImporter() {
  return {
      .id = "plus",
      .label = "PLUS fCal stylus recording (.csv)",
      .source = "PlusToolkit, PlusLibData, fCal phantom",
      .settings = {declare::choice("body", "Tracked point", {"tip", "stylus", "reference"}, "tip",
                                   "Whose pose to take: the stylus tip, or the sensor in the stylus or at the phantom"),
                   declare::flag("reject", "Reject outliers", true,
                                 "Leave samples far from the median of their landmark out of its mean")},
      .read = importPlus};
}

}  // namespace fieldtrue::importers
