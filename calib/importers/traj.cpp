#include <array>
#include <string>

#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/core/trimmed.h"
#include "calib/importers/pose_matrix.h"
#include "calib/importers/rows.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {

namespace {

/// Four numbers of a line; none when it holds anything else.
std::optional<Eigen::RowVector4d> numbersOf(std::string_view line) {
  Eigen::RowVector4d row;
  std::string_view rest = trimmed(line);
  for (Eigen::Index column = 0; column < 4; ++column) {
    const std::size_t end = std::min(rest.find_first_of(" \t"), rest.size());
    const std::optional<double> value = parseFinite(rest.substr(0, end));
    if (!value) return std::nullopt;
    row[column] = *value;
    rest = trimmed(rest.substr(end));
  }
  return rest.empty() ? std::optional(row) : std::nullopt;
}

Result<std::vector<SampleRow>> readMatrices(std::istream& in, const std::string& name, double rate_hz) {
  std::vector<SampleRow> rows;
  Eigen::Matrix4d matrix;
  Eigen::Index next_row = 0;
  LineReader lines(in, name);
  const auto bad = [&](const std::string& what) {
    return fail(ErrorCode::kBadInput, name + ", line " + std::to_string(lines.number()) + ": " + what);
  };
  for (std::string line;;) {
    FT_TRY(const bool more, lines.next(line));
    if (!more) break;
    if (trimmed(line).empty()) {
      if (next_row != 0) return bad("a matrix has " + std::to_string(next_row) + " rows, it needs 4");
      continue;
    }
    const std::optional<Eigen::RowVector4d> numbers = numbersOf(line);
    if (!numbers) return bad("a row of a matrix needs 4 finite numbers, got '" + line.substr(0, 60) + "'");
    matrix.row(next_row++) = *numbers;
    if (next_row < 4) continue;
    if (const std::string wrong = wrongWithPose(matrix); !wrong.empty()) return bad("the matrix is no pose: " + wrong);
    next_row = 0;
    SampleRow row;
    row.sample.time_s = static_cast<double>(rows.size()) / rate_hz;
    row.sample.tracker_from_sensor.position_m = matrix.topRightCorner<3, 1>();
    row.sample.tracker_from_sensor.orientation =
        canonical(Eigen::Quaterniond(Eigen::Matrix3d(matrix.topLeftCorner<3, 3>())));
    rows.push_back(row);
  }
  if (next_row != 0) return bad("the file ends after " + std::to_string(next_row) + " of the 4 rows of a matrix");
  if (rows.empty())
    return fail(ErrorCode::kBadInput, name + " holds no matrix; it needs 4x4 matrices separated by blank lines");
  return rows;
}

Result<Import> importTraj(const std::filesystem::path& path, const std::optional<std::filesystem::path>&,
                          const Settings& settings) {
  FT_TRY(std::ifstream in, openForReading(path));
  const double rate_hz = numberSetting(settings, "rate_hz");
  Result<std::vector<SampleRow>> rows = readMatrices(in, path.filename().string(), rate_hz);
  if (!rows) return tl::unexpected(rows.error());
  Import import;
  import.samples.emplace();
  import.samples->metadata.frame = "tracker";
  import.samples->metadata.rate_hz = rate_hz;
  import.samples->rows = std::move(*rows);
  import.notes.push_back("The file has no times; its rows were put " + formatNumber(1.0 / rate_hz) +
                         " s apart, as the setting rate_hz says");
  import.notes.push_back("A trajectory has no true positions: samples only");
  return import;
}

}  // namespace

/// Trajectories as 4x4 matrices separated by blank lines: samples without truth.
Importer trajImporter() {
  return {.id = "traj",
          .label = "Trajectory of 4x4 matrices in metres (.traj)",
          .source = "RMonica, hand-polhemus-dataset",
          .settings = {declare::number("rate_hz", "Rate", {0.001, 100000.0, "Hz"}, 100.0,
                                       "Rows in a second; the file itself has no times")},
          .read = importTraj};
}

}  // namespace fieldtrue::importers
