#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <tuple>

#include "calib/core/declare.h"
#include "calib/core/units.h"
#include "calib/importers/averaging.h"
#include "calib/importers/rows.h"
#include "calib/importers/text_table.h"
#include "calib/importers/truth.h"

namespace fieldtrue::importers {

namespace {

using Column = std::optional<std::size_t>;
using Group = std::optional<std::vector<std::size_t>>;

struct Layout {
  Group position, rotation, angles, true_position, true_rotation, true_angles;
  bool hasRotation() const { return rotation || angles; }
  Column node, sensor, visit, time, status;
};

/// One data row: what was tracked and, where the table has it, the truth.
struct Row {
  SampleRow tracked;
  bool has_orientation = false;
  std::optional<Pose> truth;
};

/// What one of the table's numbers of length is worth, and one of its angles.
struct Units {
  double tracked_m = 1.0;
  double true_m = 1.0;
  double angle_rad = kRadPerDeg;
};

Units unitsOf(const Settings& settings) {
  const double tracked_m = lengthUnit_m(choiceSetting(settings, "unit"));
  const std::string& of_truth = choiceSetting(settings, "unit_true");
  return {tracked_m, of_truth == kSameUnit ? tracked_m : lengthUnit_m(of_truth),
          choiceSetting(settings, "angle_unit") == "rad" ? 1.0 : kRadPerDeg};
}

/// The columns that a group of settings names: all of them, or none when every name is blank.
Result<Group> findGroup(const CsvReader& reader, const Settings& settings, const std::vector<std::string>& keys) {
  std::vector<std::string_view> names;
  std::string blank;
  for (const std::string& key : keys) {
    const std::string& name = choiceSetting(settings, key);
    if (name.empty()) blank = key;
    if (!name.empty()) names.push_back(name);
  }
  if (names.empty()) return std::nullopt;
  if (names.size() != keys.size()) {
    return fail(ErrorCode::kBadInput, "columns: the settings " + keys.front() + " to " + keys.back() +
                                          " belong together, " + blank + " is missing");
  }
  FT_TRY(const std::vector<std::size_t> places, reader.require(names));
  return places;
}

Result<Layout> findLayout(const CsvReader& reader, const Settings& settings) {
  Layout layout;
  const std::array<std::pair<std::vector<std::string>, Group*>, 6> groups{
      {{{"x", "y", "z"}, &layout.position},
       {{"qw", "qx", "qy", "qz"}, &layout.rotation},
       {{"azimuth", "elevation", "roll"}, &layout.angles},
       {{"x_true", "y_true", "z_true"}, &layout.true_position},
       {{"qw_true", "qx_true", "qy_true", "qz_true"}, &layout.true_rotation},
       {{"azimuth_true", "elevation_true", "roll_true"}, &layout.true_angles}}};
  for (const auto& [keys, group] : groups) {
    FT_TRY(const Group found, findGroup(reader, settings, keys));
    *group = found;
  }
  const std::array<std::pair<std::string, Column*>, 5> singles{{{"node", &layout.node},
                                                                {"sensor", &layout.sensor},
                                                                {"visit", &layout.visit},
                                                                {"time", &layout.time},
                                                                {"status", &layout.status}}};
  for (const auto& [key, column] : singles) {
    FT_TRY(const Group found, findGroup(reader, settings, {key}));
    if (found) *column = (*found)[0];
  }
  if (!layout.position) return fail(ErrorCode::kBadInput, "columns: the settings x, y and z must name columns");
  if ((layout.rotation && layout.angles) || (layout.true_rotation && layout.true_angles))
    return fail(ErrorCode::kBadInput, "columns: an orientation is given twice, as a quaternion and as angles");
  return layout;
}

Eigen::Vector3d position_m(CsvReader& reader, const std::vector<std::size_t>& columns, double unit_m) {
  const double x = reader.number(columns[0]);
  const double y = reader.number(columns[1]);
  const double z = reader.number(columns[2]);
  return unit_m * Eigen::Vector3d(x, y, z);
}

/// None where the columns are absent or blank.
std::optional<Eigen::Quaterniond> orientation(CsvReader& reader, const Group& quaternion, const Group& angles,
                                              double angle_rad) {
  if (!angles) return reader.quaternion(quaternion);
  Eigen::Vector3d angles_rad;
  for (Eigen::Index i = 0; i < 3; ++i)
    angles_rad[i] = reader.number((*angles)[static_cast<std::size_t>(i)]) * angle_rad;
  return canonical(rotationFromEuler(angles_rad));
}

Row readRow(CsvReader& reader, const Layout& layout, const Units& units, int row_number) {
  Row row;
  Sample& sample = row.tracked.sample;
  row.tracked.node = reader.optionalInteger(layout.node).value_or(row_number);
  row.tracked.visit = reader.optionalInteger(layout.visit).value_or(0);
  sample.sensor = reader.optionalInteger(layout.sensor).value_or(0);
  sample.time_s = reader.optionalNumber(layout.time).value_or(0.0);
  if (layout.status) sample.status = reader.field(*layout.status);
  sample.tracker_from_sensor.position_m = position_m(reader, *layout.position, units.tracked_m);
  const auto turned = orientation(reader, layout.rotation, layout.angles, units.angle_rad);
  row.has_orientation = turned.has_value();
  sample.tracker_from_sensor.orientation = turned.value_or(Eigen::Quaterniond::Identity());
  markMissing(sample);
  if (layout.true_position && row.tracked.node >= 0) {
    row.truth = Pose{position_m(reader, *layout.true_position, units.true_m),
                     orientation(reader, layout.true_rotation, layout.true_angles, units.angle_rad)
                         .value_or(Eigen::Quaterniond::Identity())};
  }
  return row;
}

Result<std::vector<Row>> readRows(CsvReader& reader, const Layout& layout, const Units& units) {
  std::vector<Row> rows;
  while (true) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    rows.push_back(readRow(reader, layout, units, static_cast<int>(rows.size())));
    if (reader.error()) return tl::unexpected(*reader.error());
  }
  if (rows.empty()) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no rows");
  return rows;
}

/// Every row as a node of its own; visits count up per node and sensor where the table does not number them.
Result<std::vector<Node>> nodesOf(const std::vector<Row>& rows, const Layout& layout, std::vector<std::string>& notes) {
  std::map<std::pair<int, int>, int> visits;
  std::set<std::tuple<int, int, int>> keys;
  std::vector<Node> nodes;
  for (const Row& row : rows) {
    const Sample& sample = row.tracked.sample;
    if (row.tracked.node < 0 || !sample.status.empty()) continue;
    Node node;
    node.node = row.tracked.node;
    node.sensor = sample.sensor;
    const int count = visits[{node.node, node.sensor}]++;
    node.visit = layout.visit ? row.tracked.visit : count;
    node.tracker_from_sensor = sample.tracker_from_sensor;
    node.has_orientation = row.has_orientation;
    if (layout.time) node.t_start_s = node.t_end_s = sample.time_s;
    if (!keys.emplace(node.node, node.sensor, node.visit).second) {
      return fail(ErrorCode::kBadInput, "columns: node " + std::to_string(node.node) + ", sensor " +
                                            std::to_string(node.sensor) + ", visit " + std::to_string(node.visit) +
                                            " comes twice; set average=true if the rows are samples to be averaged");
    }
    nodes.push_back(node);
  }
  if (nodes.empty()) return fail(ErrorCode::kTooFewNodes, "columns: no row is a good reading at a place");
  if (const std::size_t left_out = rows.size() - nodes.size())
    notes.push_back(
        std::to_string(left_out) + " of " + std::to_string(rows.size()) +
        " rows are left out: a mark in status, a reading that stands for a missing one, or a place below 0");
  const auto n_turned =
      std::count_if(nodes.begin(), nodes.end(), [](const Node& node) { return node.has_orientation; });
  if (n_turned > 0 && n_turned < std::ssize(nodes))
    notes.push_back(std::to_string(std::ssize(nodes) - n_turned) + " rows have no orientation");
  return nodes;
}

/// Truth from the table's own columns: that of the first row of each (node, sensor, visit) or, without visits, in row
/// order.
Result<void> setOwnTruth(const std::vector<Row>& rows, std::vector<Node>& nodes, bool averaged) {
  if (!averaged) {
    std::size_t next = 0;
    for (const Row& row : rows) {
      if (row.tracked.node >= 0 && row.tracked.sample.status.empty()) nodes[next++].reference_from_sensor = *row.truth;
    }
    return {};
  }
  std::map<std::tuple<int, int, int>, Pose> truths;
  for (const Row& row : rows) {
    if (!row.truth) continue;
    const auto [known, is_new] =
        truths.try_emplace({row.tracked.node, row.tracked.sample.sensor, row.tracked.visit}, *row.truth);
    if (!is_new && known->second.position_m != row.truth->position_m) {
      return fail(ErrorCode::kBadInput, "columns: node " + std::to_string(row.tracked.node) +
                                            " has more than one true position within one visit");
    }
  }
  for (Node& node : nodes) node.reference_from_sensor = truths.at({node.node, node.sensor, node.visit});
  return {};
}

/// Truth from another file, matched by node number or by order.
Result<TableMetadata> setForeignTruth(const std::filesystem::path& path, bool has_numbers, std::vector<Node>& nodes,
                                      std::vector<std::string>& notes) {
  FT_TRY(const Truth truth, readTruth(path));
  std::vector<std::string> labels;
  for (const Node& node : nodes) labels.push_back(has_numbers ? std::to_string(node.node) : "");
  FT_TRY(const TruthMatch match, matchTruth(truth, labels));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Node& known = truth.points[match.truth[i]].node;
    nodes[i].reference_from_sensor = known.reference_from_sensor;
    nodes[i].index = known.index;
    nodes[i].role = known.role;
  }
  notes.insert(notes.end(), truth.notes.begin(), truth.notes.end());
  notes.push_back(match.note);
  return truth.metadata;
}

Result<std::vector<Node>> makeNodes(const std::vector<Row>& rows, const std::vector<SampleRow>& samples,
                                    const Layout& layout, bool average, std::vector<std::string>& notes) {
  if (!average) return nodesOf(rows, layout, notes);
  if (!layout.node) return fail(ErrorCode::kBadInput, "columns: average=true needs node= to name the column of places");
  const auto lacks = [&](const Row& row) { return layout.hasRotation() && !row.has_orientation; };
  if (std::any_of(rows.begin(), rows.end(), lacks))
    return fail(ErrorCode::kBadInput,
                "columns: some rows have no orientation, so a mean of it cannot be taken; leave "
                "these rows out, or the columns of the orientation");
  FT_TRY(AveragedNodes averaged, averageRows(samples, {}, layout.hasRotation(), "Node"));
  notes.insert(notes.end(), averaged.notes.begin(), averaged.notes.end());
  return std::move(averaged.nodes);
}

Result<Import> assemble(const std::vector<Row>& rows, const Layout& layout,
                        const std::optional<std::filesystem::path>& truth_path, const Settings& settings) {
  const bool average = boolSetting(settings, "average");
  TableMetadata metadata;
  metadata.frame = choiceSetting(settings, "frame");
  std::vector<SampleRow> samples;
  for (const Row& row : rows) samples.push_back(row.tracked);
  Import import;
  if (layout.true_position || truth_path) {
    FT_TRY(std::vector<Node> nodes, makeNodes(rows, samples, layout, average, import.notes));
    if (layout.true_position) {
      FT_TRY_VOID(setOwnTruth(rows, nodes, average));
    } else {
      FT_TRY(const TableMetadata found, setForeignTruth(*truth_path, layout.node.has_value(), nodes, import.notes));
      metadata = found;
    }
    import.table = CalibrationTable{metadata, std::move(nodes)};
  } else {
    import.notes.push_back("The table has no true positions: samples only");
  }
  if (average || !import.table) import.samples = SampleTable{metadata, std::move(samples)};
  return import;
}

Result<Import> importColumns(const std::filesystem::path& path, const std::optional<std::filesystem::path>& truth_path,
                             const Settings& settings) {
  FT_TRY(TextTable text, TextTable::open(path, settings));
  CsvReader& reader = text.reader();
  FT_TRY(const Layout layout, findLayout(reader, settings));
  if (layout.true_position && truth_path) {
    return fail(ErrorCode::kBadInput,
                "columns: the truth is given twice, by x_true, y_true, z_true and by a truth file");
  }
  if ((layout.true_rotation || layout.true_angles) && !layout.true_position) {
    return fail(ErrorCode::kBadInput, "columns: a true orientation needs x_true, y_true and z_true");
  }
  FT_TRY(const std::vector<Row> rows, readRows(reader, layout, unitsOf(settings)));
  return assemble(rows, layout, truth_path, settings);
}

Setting textSetting(std::string key, std::string label, std::string usual, std::string help,
                    std::vector<std::string> choices = {}) {
  return declare::choice(std::move(key), std::move(label), std::move(choices), std::move(usual), std::move(help));
}

std::vector<Setting> columnSettings() {
  std::vector<Setting> settings;
  for (const char* axis : {"x", "y", "z"}) {
    settings.push_back(textSetting(axis, std::string("Tracked ") + axis, axis, "Column of the tracked position"));
  }
  for (const char* part : {"qw", "qx", "qy", "qz"}) {
    settings.push_back(
        textSetting(part, std::string("Tracked ") + part, "", "Column of the tracked orientation; blank = none"));
  }
  for (const char* angle : {"azimuth", "elevation", "roll"}) {
    settings.push_back(textSetting(angle, std::string("Tracked ") + angle, "",
                                   "Column of the tracked orientation's angle, Rz(az) Ry(el) Rx(roll); "
                                   "blank = none"));
  }
  for (const char* axis : {"x_true", "y_true", "z_true"}) {
    settings.push_back(
        textSetting(axis, std::string("True ") + axis[0], "", "Column of the true position; blank = none"));
  }
  for (const char* part : {"qw_true", "qx_true", "qy_true", "qz_true"}) {
    settings.push_back(
        textSetting(part, "True " + std::string(part, 2), "", "Column of the true orientation; blank = none"));
  }
  for (const char* angle : {"azimuth", "elevation", "roll"}) {
    settings.push_back(textSetting(angle + std::string("_true"), std::string("True ") + angle, "",
                                   "Column of the true orientation's angle; blank = none"));
  }
  settings.push_back(textSetting("node", "Place", "", "Column of the place's number; blank = every row is a place"));
  settings.push_back(textSetting("sensor", "Sensor", "", "Column of the sensor's number; blank = 0"));
  settings.push_back(textSetting("visit", "Visit", "", "Column of the visit's number; blank = counted"));
  settings.push_back(textSetting("time", "Time", "", "Column of the time in seconds; blank = none"));
  settings.push_back(textSetting("status", "Status", "", "Column of the tracker's error mark; blank = none"));
  settings.push_back(textSetting("unit", "Unit", "mm", "Unit of the positions", lengthUnits()));
  std::vector<std::string> units = lengthUnits();
  units.insert(units.begin(), kSameUnit);
  settings.push_back(textSetting("unit_true", "Unit of the truth", kSameUnit, "Unit of the true positions", units));
  settings.push_back(
      textSetting("angle_unit", "Unit of the angles", "deg", "Unit of azimuth, elevation and roll", {"deg", "rad"}));
  settings.push_back(textSetting("separator", "Separator", "comma", "What stands between fields", separatorNames()));
  settings.push_back(textSetting("decimal", "Decimal mark", "point", "How fractions are written", {"point", "comma"}));
  settings.push_back(declare::flag("header", "Names in the first row", true,
                                   "Without them the columns are called column1, column2, and so on"));
  settings.push_back(textSetting("frame", "Frame of the truth", "jig", "What the true positions are measured against",
                                 {"tracker", "jig", "room"}));
  settings.push_back(declare::flag("average", "Rows are samples", false,
                                   "Average the rows of each node and visit instead of taking each as a mean"));
  return settings;
}

}  // namespace

/// Any table of text: the settings name its columns, unit and separator.
Importer columnsImporter() {
  return {.id = "columns",
          .label = "Text table, columns chosen (.csv, .txt)",
          .source = "any program that writes rows of numbers",
          .settings = columnSettings(),
          .read = importColumns};
}

}  // namespace fieldtrue::importers
