#include "calib/importers/fcsv.h"

#include <array>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/importers/rows.h"
#include "calib/importers/truth.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {

namespace {

/// Signs that bring x, y, z to RAS.
Result<Eigen::Vector3d> signsToRas(const CsvReader& reader, std::vector<std::string>& notes) {
  for (const CsvReader::MetadataLine& line : reader.metadata()) {
    if (line.key != "CoordinateSystem") continue;
    if (line.value == "0" || line.value == "RAS") return Eigen::Vector3d(1.0, 1.0, 1.0);
    if (line.value == "1" || line.value == "LPS") {
      notes.push_back(reader.name() + " is in LPS; x and y were negated to RAS");
      return Eigen::Vector3d(-1.0, -1.0, 1.0);
    }
    return fail(ErrorCode::kBadInput, reader.name() + ", line " + std::to_string(line.line) +
                                          ": CoordinateSystem is '" + line.value +
                                          "', it must be 0 or RAS, or 1 or LPS");
  }
  notes.push_back(reader.name() + " does not name its coordinate system; RAS was assumed");
  return Eigen::Vector3d(1.0, 1.0, 1.0);
}

Result<Import> importFcsv(const std::filesystem::path& in, const std::optional<std::filesystem::path>& truth_path,
                          const Settings&) {
  if (!truth_path) {
    return fail(ErrorCode::kBadInput,
                in.filename().string() + " holds tracked points only; name the file of true positions too");
  }
  FT_TRY(const FcsvPoints fcsv, readFcsv(in));
  FT_TRY(const Truth truth, readTruth(*truth_path));
  std::vector<std::string> labels;
  for (const FcsvPoint& point : fcsv.points) labels.push_back(point.label);
  FT_TRY(const TruthMatch match, matchTruth(truth, labels));
  Import import;
  import.notes = fcsv.notes;
  import.notes.insert(import.notes.end(), truth.notes.begin(), truth.notes.end());
  import.notes.push_back(match.note);
  CalibrationTable table;
  table.metadata = truth.metadata;
  for (std::size_t i = 0; i < fcsv.points.size(); ++i) {
    Node node = truth.points[match.truth[i]].node;
    node.tracker_from_sensor.position_m = fcsv.points[i].position_m;
    node.has_orientation = false;
    table.nodes.push_back(node);
  }
  import.table = std::move(table);
  return import;
}

}  // namespace

Result<FcsvPoints> readFcsv(const std::filesystem::path& path) {
  FT_TRY(std::ifstream in, openForReading(path));
  FT_TRY(CsvReader reader, CsvReader::open(in, path.filename().string(), ',', CsvHeader::kComment));
  constexpr std::array<std::string_view, 3> kPosition{"x", "y", "z"};
  FT_TRY(const std::vector<std::size_t> columns, reader.require(kPosition));
  FcsvPoints fcsv;
  FT_TRY(const Eigen::Vector3d signs, signsToRas(reader, fcsv.notes));
  const std::optional<std::size_t> label = reader.find("label");
  while (true) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    const Eigen::Vector3d position_mm(reader.number(columns[0]), reader.number(columns[1]), reader.number(columns[2]));
    if (reader.error()) return tl::unexpected(*reader.error());
    fcsv.points.push_back({label ? std::string(reader.field(*label)) : "", kMPerMm * signs.cwiseProduct(position_mm)});
  }
  if (fcsv.points.empty()) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no points");
  return fcsv;
}

/// 3D Slicer markups with their truth as a node table, positions only.
Importer fcsvImporter() {
  return {.id = "fcsv",
          .label = "3D Slicer markups (.fcsv) and their true positions",
          .source = "3D Slicer 4.x, markups fiducial file",
          .needs_truth = true,
          .extension = ".fcsv",
          .read = importFcsv};
}

}  // namespace fieldtrue::importers
