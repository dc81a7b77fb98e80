#include <array>
#include <map>
#include <set>
#include <tuple>

#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/importers/averaging.h"
#include "calib/importers/rows.h"
#include "calib/importers/truth.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {

namespace {

using Column = std::optional<std::size_t>;
using Group = std::optional<std::vector<std::size_t>>;

struct Layout {
  Group position, rotation, true_position, true_rotation;
  Column node, sensor, visit, time, status;
};

/// One data row: what was tracked and, where the table has it, the truth.
struct Row {
  SampleRow tracked;
  std::optional<Pose> truth;
};

double unitOf_m(const std::string& unit) {
  static const std::map<std::string, double> units{{"mm", 1e-3}, {"cm", 1e-2}, {"in", 0.0254}, {"m", 1.0}};
  return units.at(unit);
}

char separatorOf(const std::string& name) {
  static const std::map<std::string, char> separators{
      {"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"space", ' '}};
  return separators.at(name);
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
  const std::array<std::pair<std::vector<std::string>, Group*>, 4> groups{
      {{{"x", "y", "z"}, &layout.position},
       {{"qw", "qx", "qy", "qz"}, &layout.rotation},
       {{"x_true", "y_true", "z_true"}, &layout.true_position},
       {{"qw_true", "qx_true", "qy_true", "qz_true"}, &layout.true_rotation}}};
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
  return layout;
}

Eigen::Vector3d position_m(CsvReader& reader, const std::vector<std::size_t>& columns, double unit_m) {
  const double x = reader.number(columns[0]);
  const double y = reader.number(columns[1]);
  const double z = reader.number(columns[2]);
  return unit_m * Eigen::Vector3d(x, y, z);
}

Row readRow(CsvReader& reader, const Layout& layout, double unit_m, int row_number) {
  Row row;
  Sample& sample = row.tracked.sample;
  row.tracked.node = reader.optionalInteger(layout.node).value_or(row_number);
  row.tracked.visit = reader.optionalInteger(layout.visit).value_or(0);
  sample.sensor = reader.optionalInteger(layout.sensor).value_or(0);
  sample.time_s = reader.optionalNumber(layout.time).value_or(0.0);
  if (layout.status) sample.status = reader.field(*layout.status);
  sample.tracker_from_sensor.position_m = position_m(reader, *layout.position, unit_m);
  sample.tracker_from_sensor.orientation = reader.quaternion(layout.rotation).value_or(Eigen::Quaterniond::Identity());
  markMissing(sample);
  if (layout.true_position && row.tracked.node >= 0) {
    row.truth = Pose{position_m(reader, *layout.true_position, unit_m),
                     reader.quaternion(layout.true_rotation).value_or(Eigen::Quaterniond::Identity())};
  }
  return row;
}

Result<std::vector<Row>> readRows(CsvReader& reader, const Layout& layout, double unit_m) {
  std::vector<Row> rows;
  while (true) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    rows.push_back(readRow(reader, layout, unit_m, static_cast<int>(rows.size())));
    if (reader.error()) return tl::unexpected(*reader.error());
  }
  if (rows.empty()) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no rows");
  return rows;
}

/// Every row as a node of its own; visits count up per node and sensor where the table does not number them.
Result<std::vector<Node>> nodesOf(const std::vector<Row>& rows, const Layout& layout) {
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
    node.has_orientation = layout.rotation.has_value();
    if (layout.time) node.t_start_s = node.t_end_s = sample.time_s;
    if (!keys.emplace(node.node, node.sensor, node.visit).second) {
      return fail(ErrorCode::kBadInput, "columns: node " + std::to_string(node.node) + ", sensor " +
                                            std::to_string(node.sensor) + ", visit " + std::to_string(node.visit) +
                                            " comes twice; set average=true if the rows are samples to be averaged");
    }
    nodes.push_back(node);
  }
  if (nodes.empty()) return fail(ErrorCode::kTooFewNodes, "columns: no row is a good reading at a place");
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
  if (!average) return nodesOf(rows, layout);
  if (!layout.node) return fail(ErrorCode::kBadInput, "columns: average=true needs node= to name the column of places");
  FT_TRY(AveragedNodes averaged, averageRows(samples, {}, layout.rotation.has_value(), "Node"));
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
  FT_TRY(std::ifstream in, openForReading(path));
  FT_TRY(CsvReader reader,
         CsvReader::open(in, path.filename().string(), separatorOf(choiceSetting(settings, "separator"))));
  FT_TRY(const Layout layout, findLayout(reader, settings));
  if (layout.true_position && truth_path) {
    return fail(ErrorCode::kBadInput,
                "columns: the truth is given twice, by x_true, y_true, z_true and by a truth file");
  }
  if (layout.true_rotation && !layout.true_position) {
    return fail(ErrorCode::kBadInput, "columns: qw_true to qz_true need x_true, y_true and z_true");
  }
  FT_TRY(const std::vector<Row> rows, readRows(reader, layout, unitOf_m(choiceSetting(settings, "unit"))));
  return assemble(rows, layout, truth_path, settings);
}

Setting textSetting(std::string key, std::string label, std::string usual, std::string help,
                    std::vector<std::string> choices = {}) {
  return declare::choice(std::move(key), std::move(label), std::move(choices), std::move(usual), std::move(help));
}

}  // namespace

/// Any table with a header row: the settings name its columns, unit and separator.
Importer columnsImporter() {
  std::vector<Setting> settings;
  for (const char* axis : {"x", "y", "z"}) {
    settings.push_back(textSetting(axis, std::string("Tracked ") + axis, axis, "Column of the tracked position"));
  }
  for (const char* part : {"qw", "qx", "qy", "qz"}) {
    settings.push_back(
        textSetting(part, std::string("Tracked ") + part, "", "Column of the tracked orientation; blank = none"));
  }
  for (const char* axis : {"x_true", "y_true", "z_true"}) {
    settings.push_back(
        textSetting(axis, std::string("True ") + axis[0], "", "Column of the true position; blank = none"));
  }
  for (const char* part : {"qw_true", "qx_true", "qy_true", "qz_true"}) {
    settings.push_back(
        textSetting(part, "True " + std::string(part, 2), "", "Column of the true orientation; blank = none"));
  }
  settings.push_back(textSetting("node", "Place", "", "Column of the place's number; blank = every row is a place"));
  settings.push_back(textSetting("sensor", "Sensor", "", "Column of the sensor's number; blank = 0"));
  settings.push_back(textSetting("visit", "Visit", "", "Column of the visit's number; blank = counted"));
  settings.push_back(textSetting("time", "Time", "", "Column of the time in seconds; blank = none"));
  settings.push_back(textSetting("status", "Status", "", "Column of the tracker's error mark; blank = none"));
  settings.push_back(textSetting("unit", "Unit", "mm", "Unit of all positions", {"mm", "cm", "in", "m"}));
  settings.push_back(textSetting("separator", "Separator", "comma", "What stands between fields",
                                 {"comma", "semicolon", "tab", "space"}));
  settings.push_back(textSetting("frame", "Frame of the truth", "jig", "What the true positions are measured against",
                                 {"tracker", "jig", "room"}));
  settings.push_back(declare::flag("average", "Rows are samples", false,
                                   "Average the rows of each node and visit instead of taking each as a mean"));
  return {.id = "columns",
          .label = "Table with named columns (.csv)",
          .source = "any program that writes a header row",
          .settings = settings,
          .read = importColumns};
}

}  // namespace fieldtrue::importers
