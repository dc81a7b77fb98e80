#include "calib/tables/table_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "calib/core/file_io.h"
#include "calib/core/statistics.h"
#include "calib/tables/csv_reader.h"
#include "calib/tables/table_metadata.h"

namespace fieldtrue {

namespace {

using Names = std::vector<std::string_view>;
using Column = std::optional<std::size_t>;
using Group = std::optional<std::vector<std::size_t>>;

const Names kRequired{"node", "x_true_m", "y_true_m", "z_true_m", "x_m", "y_m", "z_m"};
const Names kIndex{"i", "j", "k"};
const Names kTrueRotation{"qw_true", "qx_true", "qy_true", "qz_true"};
const Names kRotation{"qw", "qx", "qy", "qz"};
const Names kSd{"sd_x_m", "sd_y_m", "sd_z_m"};
const Names kCovariance{"cov_xy_m2", "cov_xz_m2", "cov_yz_m2"};
const Names kSingles{"sensor", "visit",      "t_start_s",   "t_end_s", "sd_rot_rad",
                     "n_used", "n_rejected", "n_effective", "role"};

struct NodeColumns {
  std::vector<std::size_t> required;
  Group index, true_rotation, rotation, sd, covariance;
  Column sensor, visit, t_start, t_end, sd_rot, n_used, n_rejected, n_effective, role;
};

Result<NodeColumns> findNodeColumns(const CsvReader& reader) {
  NodeColumns columns;
  const Result<std::vector<std::size_t>> required = reader.require(kRequired);
  if (!required) return tl::unexpected(required.error());
  columns.required = *required;
  const std::array<std::pair<const Names*, Group*>, 5> groups{{{&kIndex, &columns.index},
                                                               {&kTrueRotation, &columns.true_rotation},
                                                               {&kRotation, &columns.rotation},
                                                               {&kSd, &columns.sd},
                                                               {&kCovariance, &columns.covariance}}};
  for (const auto& [names, group] : groups) {
    FT_TRY(const Group found, reader.group(*names));
    *group = found;
  }
  if (columns.covariance && !columns.sd) {
    return fail(ErrorCode::kBadInput, reader.name() + ", line " + std::to_string(reader.line()) +
                                          ": the columns cov_xy_m2, cov_xz_m2, cov_yz_m2 need sd_x_m, sd_y_m, sd_z_m");
  }
  const std::array<Column*, 9> singles{&columns.sensor,     &columns.visit,       &columns.t_start,
                                       &columns.t_end,      &columns.sd_rot,      &columns.n_used,
                                       &columns.n_rejected, &columns.n_effective, &columns.role};
  for (std::size_t i = 0; i < singles.size(); ++i) *singles[i] = reader.find(kSingles[i]);
  return columns;
}

/// All of the group's fields or none of them may be blank. @return whether they hold values
bool isGiven(CsvReader& reader, const Group& group) {
  if (!group) return false;
  const auto blank = std::find_if(group->begin(), group->end(), [&](std::size_t c) { return reader.isBlank(c); });
  if (blank == group->end()) return true;
  const bool all_blank = std::all_of(group->begin(), group->end(), [&](std::size_t c) { return reader.isBlank(c); });
  if (!all_blank) reader.failAt(*blank, "the field is blank, its neighbours are not");
  return false;
}

double numberFrom(CsvReader& reader, std::size_t column, double lowest) {
  const double value = reader.number(column);
  if (value < lowest)
    reader.failAt(column, formatNumber(value) + " is too small, it must be " + formatNumber(lowest) + " or more");
  return value;
}

int countFrom(CsvReader& reader, const Column& column, int default_value, int lowest) {
  const int value = reader.optionalInteger(column).value_or(default_value);
  if (column && value < lowest) {
    reader.failAt(*column, std::to_string(value) + " is too small, it must be " + std::to_string(lowest) + " or more");
  }
  return value;
}

/// A position of a node; the marks of missing readings are no position.
Eigen::Vector3d position_m(CsvReader& reader, const std::vector<std::size_t>& columns, std::size_t first) {
  Eigen::Vector3d p_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value_m = reader.number(columns[first + axis]);
    if (isMissingMark(value_m)) {
      reader.failAt(columns[first + axis], formatNumber(value_m) + " is the mark of a missing reading, not a position");
    }
    p_m[static_cast<Eigen::Index>(axis)] = value_m;
  }
  return p_m;
}

void readCovariance(CsvReader& reader, const NodeColumns& columns, Node& node) {
  if (!isGiven(reader, columns.sd)) {
    if (isGiven(reader, columns.covariance))
      reader.failAt((*columns.sd)[0], "the field is blank, the covariances are not");
    return;
  }
  Eigen::Vector3d sd_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sd_m[static_cast<Eigen::Index>(axis)] = numberFrom(reader, (*columns.sd)[axis], 0.0);
  }
  Eigen::Matrix3d covariance_m2 = sd_m.cwiseAbs2().asDiagonal();
  if (isGiven(reader, columns.covariance)) {
    constexpr std::array<std::pair<int, int>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};
    for (std::size_t pair = 0; pair < 3; ++pair) {
      const auto [a, b] = kPairs[pair];
      const double value_m2 = reader.number((*columns.covariance)[pair]);
      if (std::abs(value_m2) > sd_m[a] * sd_m[b] * (1.0 + 1e-6)) {
        reader.failAt((*columns.covariance)[pair], formatNumber(value_m2) + " exceeds the product of the two SDs");
      }
      covariance_m2(a, b) = value_m2;
      covariance_m2(b, a) = value_m2;
    }
  }
  node.covariance_m2 = covariance_m2;
}

void readCounts(CsvReader& reader, const NodeColumns& columns, Node& node) {
  node.n_used = countFrom(reader, columns.n_used, 1, 0);
  node.n_rejected = countFrom(reader, columns.n_rejected, 0, 0);
  node.n_effective = reader.optionalNumber(columns.n_effective).value_or(node.n_used);
  if (columns.n_effective && (node.n_effective < 0.0 || (node.n_effective == 0.0 && node.n_used > 0))) {
    reader.failAt(*columns.n_effective, formatNumber(node.n_effective) + " is too small, it must be more than 0");
  }
}

void readTimes(CsvReader& reader, const NodeColumns& columns, Node& node) {
  node.t_start_s = reader.optionalNumber(columns.t_start);
  node.t_end_s = reader.optionalNumber(columns.t_end);
  if (node.t_start_s && node.t_end_s && *node.t_end_s < *node.t_start_s) {
    reader.failAt(*columns.t_end,
                  formatNumber(*node.t_end_s) + " is before t_start_s, " + formatNumber(*node.t_start_s));
  }
}

NodeRole readRole(CsvReader& reader, const Column& column) {
  if (!column) return NodeRole::kFit;
  if (reader.isBlank(*column)) {
    if (!reader.lineHasNewline()) reader.failAt(*column, "the file ends before the role; it may be cut off");
    return NodeRole::kFit;
  }
  const std::string_view text = reader.field(*column);
  for (const auto& [name, role] : kNodeRoles) {
    if (name == text) return role;
  }
  reader.failAt(*column, "'" + std::string(text) + "' is not one of fit, validation, skipped");
  return NodeRole::kFit;
}

/// 0 where there is no such column.
int sensorFrom(CsvReader& reader, Column column) {
  const int sensor = reader.optionalInteger(column).value_or(0);
  if (sensor < 0) reader.failAt(*column, std::to_string(sensor) + " is no sensor, it must be 0 or more");
  return sensor;
}

Node readNode(CsvReader& reader, const NodeColumns& columns) {
  Node node;
  node.node = reader.integer(columns.required[0]);
  if (node.node < 0)
    reader.failAt(columns.required[0], std::to_string(node.node) + " is no place, it must be 0 or more");
  node.sensor = sensorFrom(reader, columns.sensor);
  if (isGiven(reader, columns.index)) {
    const std::vector<std::size_t>& c = *columns.index;
    node.index = {reader.integer(c[0]), reader.integer(c[1]), reader.integer(c[2])};
  }
  node.reference_from_sensor.position_m = position_m(reader, columns.required, 1);
  node.tracker_from_sensor.position_m = position_m(reader, columns.required, 4);
  const Eigen::Quaterniond identity = Eigen::Quaterniond::Identity();
  node.reference_from_sensor.orientation = reader.quaternion(columns.true_rotation).value_or(identity);
  const std::optional<Eigen::Quaterniond> tracked = reader.quaternion(columns.rotation);
  node.has_orientation = tracked.has_value();
  node.tracker_from_sensor.orientation = tracked.value_or(identity);
  readCovariance(reader, columns, node);
  if (columns.sd_rot && !reader.isBlank(*columns.sd_rot)) node.sd_rot_rad = numberFrom(reader, *columns.sd_rot, 0.0);
  readCounts(reader, columns, node);
  readTimes(reader, columns, node);
  node.role = readRole(reader, columns.role);
  if (node.n_used == 0 && node.role != NodeRole::kSkipped)
    reader.failAt(*columns.n_used, "0 readings make no mean; it must be 1 or more, or the role skipped");
  return node;
}

/// Gives visits their numbers and watches that no (node, sensor, visit) comes twice.
class NodeKeys {
 public:
  void add(CsvReader& reader, const NodeColumns& columns, Node& node) {
    const std::optional<int> visit = reader.optionalInteger(columns.visit);
    int& rows = rows_[{node.node, node.sensor}];
    node.visit = visit.value_or(rows);
    ++rows;
    const auto [found, is_new] = lines_.try_emplace({node.node, node.sensor, node.visit}, reader.line());
    if (is_new) return;
    reader.failAt(columns.required[0], "node " + std::to_string(node.node) + ", sensor " + std::to_string(node.sensor) +
                                           ", visit " + std::to_string(node.visit) + " stands already in line " +
                                           std::to_string(found->second));
  }

 private:
  std::map<std::pair<int, int>, int> rows_;
  std::map<std::tuple<int, int, int>, int> lines_;
};

Names nodeColumnNames() {
  Names names;
  for (const Names* group : {&kRequired, &kIndex, &kTrueRotation, &kRotation, &kSd, &kCovariance, &kSingles}) {
    names.insert(names.end(), group->begin(), group->end());
  }
  return names;
}

const Names kSampleRequired{"node", "t_s", "x_m", "y_m", "z_m"};
const Names kSampleKnown{"node", "sensor", "visit", "t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "status"};

struct SampleColumns {
  std::vector<std::size_t> required;
  Group rotation;
  Column sensor, visit, status;
};

Result<SampleColumns> findSampleColumns(const CsvReader& reader) {
  FT_TRY(const std::vector<std::size_t> required, reader.require(kSampleRequired));
  FT_TRY(const Group rotation, reader.group(kRotation));
  return SampleColumns{required, rotation, reader.find("sensor"), reader.find("visit"), reader.find("status")};
}

/// Whether a field holds nothing usable although it is no mistake: blank, "nan" or a mark.
bool holdsNoReading(const CsvReader& reader, std::size_t column) {
  const std::optional<double> value = parseFinite(reader.field(column));
  return reader.isBlank(column) || reader.field(column) == "nan" || (value && isMissingMark(*value));
}

/// The pose of a sample that carries a status may be blank or nan; a mark of a missing reading sets the status.
void readSamplePose(CsvReader& reader, const SampleColumns& columns, Sample& sample) {
  std::vector<std::size_t> pose_columns(columns.required.begin() + 2, columns.required.end());
  if (columns.rotation) pose_columns.insert(pose_columns.end(), columns.rotation->begin(), columns.rotation->end());
  const bool has_mark = std::any_of(pose_columns.begin(), pose_columns.end(), [&](std::size_t column) {
    const std::optional<double> value = parseFinite(reader.field(column));
    return value && isMissingMark(*value);
  });
  if (has_mark && sample.status.empty()) sample.status = "missing";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t column = pose_columns[axis];
    const bool is_unreadable =
        !sample.status.empty() && holdsNoReading(reader, column) && !parseFinite(reader.field(column));
    sample.tracker_from_sensor.position_m[static_cast<Eigen::Index>(axis)] =
        is_unreadable ? std::nan("") : reader.number(column);
  }
  const bool skips_rotation = !sample.status.empty() && columns.rotation &&
                              std::any_of(columns.rotation->begin(), columns.rotation->end(),
                                          [&](std::size_t c) { return holdsNoReading(reader, c); });
  if (!skips_rotation) {
    sample.tracker_from_sensor.orientation =
        reader.quaternion(columns.rotation).value_or(Eigen::Quaterniond::Identity());
  }
}

SampleRow readSampleRow(CsvReader& reader, const SampleColumns& columns) {
  SampleRow row;
  row.node = reader.integer(columns.required[0]);
  if (row.node < -1) {
    reader.failAt(columns.required[0],
                  std::to_string(row.node) + " is no place, it must be 0 or more, or -1 between places");
  }
  row.visit = reader.optionalInteger(columns.visit).value_or(0);
  row.sample.sensor = sensorFrom(reader, columns.sensor);
  row.sample.time_s = reader.number(columns.required[1]);
  if (columns.status) row.sample.status = reader.field(*columns.status);
  readSamplePose(reader, columns, row.sample);
  return row;
}

std::vector<std::string> notesOn(const CsvReader& reader, const Names& known, bool has_rotation) {
  std::vector<std::string> notes;
  std::string ignored;
  const std::vector<std::string> unknown = reader.unknown(known);
  for (const std::string& column : unknown) ignored += (ignored.empty() ? "" : ", ") + column;
  if (unknown.size() == 1) notes.push_back(reader.name() + ": the column " + ignored + " is not known and was ignored");
  if (unknown.size() > 1)
    notes.push_back(reader.name() + ": the columns " + ignored + " are not known and were ignored");
  for (std::string& note : notesOnMetadata(reader)) notes.push_back(std::move(note));
  if (const std::optional<std::string> note = reader.noteOnLateMetadata()) notes.push_back(*note);
  if (!has_rotation) notes.push_back(reader.name() + ": there are no columns qw, qx, qy, qz: positions only");
  if (const std::optional<std::string> note = reader.noteOnLastLine()) notes.push_back(*note);
  return notes;
}

/// Reads every row with `add`, which leaves its failures in the reader; then the metadata.
template <class Add>
Result<TableMetadata> readRows(CsvReader& reader, const Add& add) {
  bool is_empty = true;
  while (true) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    is_empty = false;
    add();
    if (reader.error()) return tl::unexpected(*reader.error());
  }
  if (is_empty) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no rows");
  return parseMetadata(reader);
}

template <class Table>
using Read = Result<TableReading<Table>> (*)(std::istream&, const std::string&);

template <class Table>
Result<TableReading<Table>> readPath(const std::filesystem::path& path, Read<Table> read) {
  FT_TRY(std::ifstream in, openForReading(path));
  return read(in, path.filename().string());
}

}  // namespace

Result<TableReading<CalibrationTable>> readNodeTable(std::istream& in, const std::string& name) {
  FT_TRY(CsvReader reader, CsvReader::open(in, name));
  FT_TRY(const NodeColumns columns, findNodeColumns(reader));
  TableReading<CalibrationTable> reading;
  NodeKeys keys;
  const Result<TableMetadata> metadata = readRows(reader, [&] {
    Node node = readNode(reader, columns);
    if (reader.error()) return;
    keys.add(reader, columns, node);
    reading.table.nodes.push_back(std::move(node));
    reading.lines.push_back(reader.line());
  });
  if (!metadata) return tl::unexpected(metadata.error());
  reading.table.metadata = *metadata;
  reading.notes = notesOn(reader, nodeColumnNames(), columns.rotation.has_value());
  return reading;
}

Result<TableReading<SampleTable>> readSampleTable(std::istream& in, const std::string& name) {
  FT_TRY(CsvReader reader, CsvReader::open(in, name));
  FT_TRY(const SampleColumns columns, findSampleColumns(reader));
  TableReading<SampleTable> reading;
  const Result<TableMetadata> metadata =
      readRows(reader, [&] { reading.table.rows.push_back(readSampleRow(reader, columns)); });
  if (!metadata) return tl::unexpected(metadata.error());
  reading.table.metadata = *metadata;
  reading.notes = notesOn(reader, kSampleKnown, columns.rotation.has_value());
  return reading;
}

Result<TableReading<CalibrationTable>> readNodeTable(const std::filesystem::path& path) {
  return readPath<CalibrationTable>(path, readNodeTable);
}

Result<TableReading<SampleTable>> readSampleTable(const std::filesystem::path& path) {
  return readPath<SampleTable>(path, readSampleTable);
}

}  // namespace fieldtrue
