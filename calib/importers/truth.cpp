#include "calib/importers/truth.h"

#include <map>

#include "calib/core/file_io.h"
#include "calib/importers/fcsv.h"
#include "calib/tables/table_io.h"

namespace fieldtrue::importers {

namespace {

struct TruthColumns {
  std::array<std::string_view, 3> names;
  double unit_m;
};
constexpr std::array<TruthColumns, 5> kTruthColumns{{{{"x_true_m", "y_true_m", "z_true_m"}, 1.0},
                                                     {{"true_x_mm", "true_y_mm", "true_z_mm"}, 1e-3},
                                                     {{"x_true_mm", "y_true_mm", "z_true_mm"}, 1e-3},
                                                     {{"x_mm", "y_mm", "z_mm"}, 1e-3},
                                                     {{"x_m", "y_m", "z_m"}, 1.0}}};

TruthPoint pointAt(const Eigen::Vector3d& position_m, std::string label, std::size_t place) {
  TruthPoint point;
  point.label = std::move(label);
  point.node.node = static_cast<int>(place);
  point.node.reference_from_sensor.position_m = position_m;
  return point;
}

Result<Truth> truthOfNodeTable(const std::filesystem::path& path) {
  FT_TRY(TableReading<CalibrationTable> reading, readNodeTable(path));
  Truth truth;
  truth.metadata = reading.table.metadata;
  truth.notes = reading.notes;
  for (const Node& row : reading.table.nodes) {
    Node node;
    node.node = row.node;
    node.sensor = row.sensor;
    node.visit = row.visit;
    node.index = row.index;
    node.role = row.role;
    node.reference_from_sensor = row.reference_from_sensor;
    truth.points.push_back({std::to_string(row.node), node});
  }
  return truth;
}

Result<Truth> truthOfFcsv(const std::filesystem::path& path) {
  FT_TRY(const FcsvPoints fcsv, readFcsv(path));
  Truth truth;
  truth.notes = fcsv.notes;
  for (const FcsvPoint& point : fcsv.points) {
    truth.points.push_back(pointAt(point.position_m, point.label, truth.points.size()));
  }
  return truth;
}

Result<Truth> truthOfColumns(CsvReader& reader) {
  for (const TruthColumns& row : kTruthColumns) {
    const Result<std::vector<std::size_t>> columns = reader.require(row.names);
    if (!columns) continue;
    std::optional<std::size_t> label;
    for (const char* name : {"label", "node", "id", "name", "point", "place"})
      if (!label) label = reader.find(name);
    Truth truth;
    while (true) {
      FT_TRY(const bool more, reader.next());
      if (!more) return truth;
      const Eigen::Vector3d position(reader.number((*columns)[0]), reader.number((*columns)[1]),
                                     reader.number((*columns)[2]));
      if (reader.error()) return tl::unexpected(*reader.error());
      truth.points.push_back(
          pointAt(position * row.unit_m, label ? std::string(reader.field(*label)) : "", truth.points.size()));
    }
  }
  return fail(ErrorCode::kBadInput, reader.name() +
                                        " has no true positions; it needs columns x_true_m, y_true_m, z_true_m or "
                                        "true_x_mm, true_y_mm, true_z_mm or x_mm, y_mm, z_mm");
}

}  // namespace

Result<Truth> readTruth(const std::filesystem::path& path) {
  if (path.extension() == ".fcsv") return truthOfFcsv(path);
  FT_TRY(std::ifstream in, openForReading(path));
  FT_TRY(CsvReader reader, CsvReader::open(in, path.filename().string()));
  const bool is_node_table = reader.find("x_true_m") && reader.find("x_m") && reader.find("node");
  Result<Truth> truth = is_node_table ? truthOfNodeTable(path) : truthOfColumns(reader);
  if (truth && truth->points.empty()) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no points");
  return truth;
}

Result<TruthMatch> matchTruth(const Truth& truth, const std::vector<std::string>& labels) {
  std::map<std::string, std::size_t> places;
  bool is_by_label = true;
  for (std::size_t i = 0; i < truth.points.size(); ++i) {
    is_by_label &= !truth.points[i].label.empty() && places.emplace(truth.points[i].label, i).second;
  }
  std::map<std::string, std::size_t> seen;
  for (const std::string& label : labels) is_by_label &= places.contains(label) && ++seen[label] == 1;
  TruthMatch match;
  if (is_by_label) {
    for (const std::string& label : labels) match.truth.push_back(places.at(label));
    match.note = "The true positions were matched by label";
    return match;
  }
  if (labels.size() != truth.points.size()) {
    return fail(ErrorCode::kBadInput, "The recording has " + std::to_string(labels.size()) +
                                          " points and the truth file " + std::to_string(truth.points.size()) +
                                          "; without matching labels both need the same number in the same order");
  }
  for (std::size_t i = 0; i < labels.size(); ++i) match.truth.push_back(i);
  match.note = "The true positions were matched by order: the labels of the two files differ";
  return match;
}

}  // namespace fieldtrue::importers
