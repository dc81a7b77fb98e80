#include <algorithm>
#include <array>

#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/importers/rows.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {

namespace {

constexpr std::array<std::string_view, 8> kColumns{"condition", "node",         "true_x_mm",    "true_y_mm",
                                                   "true_z_mm", "tracked_x_mm", "tracked_y_mm", "tracked_z_mm"};

Eigen::Vector3d position_m(CsvReader& reader, const std::vector<std::size_t>& columns, std::size_t first) {
  const double x_mm = reader.number(columns[first]);
  const double y_mm = reader.number(columns[first + 1]);
  const double z_mm = reader.number(columns[first + 2]);
  return kMPerMm * Eigen::Vector3d(x_mm, y_mm, z_mm);
}

Node readNode(CsvReader& reader, const std::vector<std::size_t>& columns) {
  Node node;
  node.node = reader.integer(columns[1]);
  node.reference_from_sensor.position_m = position_m(reader, columns, 2);
  node.tracker_from_sensor.position_m = position_m(reader, columns, 5);
  node.has_orientation = false;
  return node;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

Result<Import> importAnser(const std::filesystem::path& path, const std::optional<std::filesystem::path>&,
                           const Settings& settings) {
  FT_TRY(std::ifstream in, openForReading(path));
  FT_TRY(CsvReader reader, CsvReader::open(in, path.filename().string()));
  FT_TRY(const std::vector<std::size_t> columns, reader.require(kColumns));
  const std::string& wanted = choiceSetting(settings, "condition");
  std::vector<std::string> found;
  CalibrationTable table;
  while (true) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    const std::string condition(reader.field(columns[0]));
    if (std::find(found.begin(), found.end(), condition) == found.end()) found.push_back(condition);
    if (condition != wanted) continue;
    const Node node = readNode(reader, columns);
    const bool is_repeated =
        std::any_of(table.nodes.begin(), table.nodes.end(), [&](const Node& other) { return other.node == node.node; });
    if (is_repeated) {
      reader.failAt(columns[1], "node " + std::to_string(node.node) + " comes twice in condition " + wanted);
    }
    if (reader.error()) return tl::unexpected(*reader.error());
    table.nodes.push_back(node);
  }
  if (table.nodes.empty()) {
    return fail(ErrorCode::kBadInput,
                reader.name() + " has no condition " + wanted + "; its conditions are " + joined(found));
  }
  table.metadata.tracker = "Anser EMT";
  table.metadata.transmitter_model = "planar_coils";
  table.metadata.rig = "LEGO Duplo board, 31.75 mm pitch";
  table.metadata.other["condition"] = wanted;
  Import import;
  import.notes.push_back("Condition " + wanted + " of " + joined(found));
  import.notes.push_back("There is one position and no orientation at each place");
  import.table = std::move(table);
  return import;
}

}  // namespace

/// The table of Anser EMT's Duplo-board recordings: one condition of it as a node table, positions only.
Importer anserImporter() {
  return {.id = "anser",
          .label = "Anser EMT Duplo-board table (.csv)",
          .source = "Jaeger, O'Donoghue, Matlab-Anser, mapping/data_out",
          .settings = {declare::choice(
              "condition", "Condition",
              {"standard_data_grid", "interpolate_data_grid", "interpolate_data_grid_probe_calibrate",
               "finer_mesh_points", "finer_mesh_3axis", "steel_shield"},
              "standard_data_grid", "Which of the table's recordings to take")},
          .read = importAnser};
}

}  // namespace fieldtrue::importers
