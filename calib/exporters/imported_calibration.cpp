#include "calib/exporters/imported_calibration.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/correctors/baked/imported_lattice.h"
#include "calib/exporters/registry.h"
#include "calib/recording/unit_slip.h"

namespace fieldtrue::exporters {
namespace {

using calibration::Corrector;
using correctors::LatticeVectors;

/// Rows along an axis that stand for the lattice in the calibration's table.
constexpr int kRowsAlong = 6;

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

Result<const Exporter*> readerFor(const CalibrationFormat& format, const std::filesystem::path& path) {
  if (format.exporter_ids.size() == 1) return findExporter(format.exporter_ids.front());
  const std::string name = lowerCase(path.filename().string());
  std::string known;
  for (const std::string& id : format.exporter_ids) {
    FT_TRY(const Exporter* exporter, findExporter(id));
    const std::string ending = exporter->extension.substr(exporter->extension.rfind('.'));
    if (name.ends_with(ending)) return exporter;
    if (!known.empty()) known += ", ";
    known += ending;
  }
  return fail(ErrorCode::kBadInput,
              path.filename().string() + " has none of the endings of format " + format.id + ": " + known);
}

LatticeVectors latticeOf(const LatticePoints& points) {
  LatticeVectors lattice;
  lattice.origin_m = points.origin_m;
  lattice.axes = points.axes;
  lattice.pitch_m = points.pitch_m;
  lattice.counts = points.counts;
  return lattice;
}

void append(std::vector<float>& values, const Eigen::Vector3d& vector) {
  for (const double value : vector) values.push_back(static_cast<float>(value));
}

bool isInside(const LatticeField& field, std::size_t index) { return field.inside.empty() || field.inside[index] != 0; }

/// Indices along an axis, first and last among them.
std::vector<int> someOf(int count) {
  std::vector<int> some;
  const int n = std::min(count, kRowsAlong);
  for (int i = 0; i < n; ++i) some.push_back(static_cast<int>(std::lround(double(i) * (count - 1) / (n - 1))));
  return some;
}

/// Points of the lattice as rows: where it takes them counts as true.
CalibrationTable rowsOf(const LatticeField& field, const std::string& source) {
  CalibrationTable table;
  table.metadata.frame = "imported";
  table.metadata.alignment_known = true;
  table.metadata.other["imported_from"] = source;
  for (const int k : someOf(field.points.counts[2]))
    for (const int j : someOf(field.points.counts[1]))
      for (const int i : someOf(field.points.counts[0])) {
        const std::size_t index = field.points.at(i, j, k);
        if (!isInside(field, index)) continue;
        Node row;
        row.node = static_cast<int>(table.nodes.size());
        row.tracker_from_sensor.position_m = field.points.point_m(i, j, k);
        row.reference_from_sensor.position_m = row.tracker_from_sensor.position_m + field.displacement_m[index];
        row.has_orientation = !field.rotation.empty();
        if (row.has_orientation) row.reference_from_sensor.orientation = field.rotation[index].normalized();
        table.nodes.push_back(row);
      }
  return table;
}

Region regionOf(const LatticeField& field) {
  std::vector<Eigen::Vector3d> points_m;
  for (std::size_t i = 0; i < field.points.size(); ++i)
    if (isInside(field, i)) points_m.push_back(field.points.point_m(i));
  return Region::around(points_m, 3, 0.0);
}

/// False also for what is not finite.
bool isWithinReach(const Eigen::Vector3d& moved_m) { return moved_m.norm() <= recording::kTrackerReach_m; }

/// What is wrong with a displacement that no tracker needs.
std::string wrongText(const Eigen::Vector3d& moved_m, const CalibrationFormat& format) {
  if (!moved_m.allFinite()) return " is not a finite number";
  // With an exponent where it must be: damaged numbers have hundreds of digits.
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.begin(), text.end(), moved_m.stableNorm(), std::chars_format::general, 3).ptr;
  return " is " + std::string(text.begin(), end) + " m, more than the " + shortNumber(recording::kTrackerReach_m) +
         " m that any tracker reaches; its numbers were taken as " + format.unit;
}

/// As calibration files must have it.
Result<void> checkPoints(const LatticePoints& points, const std::string& name) {
  if (!points.origin_m.allFinite() || !points.pitch_m.allFinite() || !(points.pitch_m.minCoeff() > 0.0))
    return fail(ErrorCode::kBadInput,
                name + ": the origin and spacing of the lattice must be finite, the spacing above 0");
  if (!(points.axes.transpose() * points.axes).isApprox(Eigen::Matrix3d::Identity(), 1e-6))
    return fail(ErrorCode::kBadInput, name + ": the axes of the lattice are not at right angles");
  return {};
}

Result<void> check(const LatticeField& field, const CalibrationFormat& format, const std::string& name) {
  if (field.points.size() > correctors::kMostImportedPoints)
    return fail(ErrorCode::kBadInput, name + " has " + std::to_string(field.points.size()) +
                                          " points, and a calibration holds at most " +
                                          std::to_string(correctors::kMostImportedPoints) + "; thin the field out");
  FT_TRY_VOID(checkPoints(field.points, name));
  for (std::size_t i = 0; i < field.displacement_m.size(); ++i)
    if (isInside(field, i) && !isWithinReach(field.displacement_m[i]))
      return fail(ErrorCode::kBadInput, name + ": the displacement of point " + std::to_string(i) +
                                            wrongText(field.displacement_m[i], format));
  for (std::size_t i = 0; i < field.rotation.size(); ++i)
    if (isInside(field, i) && !field.rotation[i].coeffs().allFinite())
      return fail(ErrorCode::kBadInput, name + ": the turn of point " + std::to_string(i) + " is not a finite number");
  if (std::none_of(field.inside.begin(), field.inside.end(), [](char one) { return one != 0; }) &&
      !field.inside.empty())
    return fail(ErrorCode::kBadInput, name + " has no point that counts as inside");
  return {};
}

/// Whether a file says that it takes true positions to measured ones: by the words that every export of ours carries,
/// or by 3D Slicer's key for fields that resample.
bool saysTrueToMeasured(const std::string& content) {
  return content.find(directionText(Direction::kTrueToMeasured)) != std::string::npos ||
         content.substr(0, content.find("\n\n")).find("displacement field type:=resampling") != std::string::npos;
}

}  // namespace

std::span<const CalibrationFormat> calibrationFormats() {
  static const std::vector<CalibrationFormat> formats = {
      {"itk_field",
       "ITK displacement field (.nrrd, .mha, .h5, .tfm)",
       "mm, LPS",
       {"itk_nrrd", "itk_mha", "itk_h5", "itk_tfm"}},
      {"vtk_field", "VTK displacement field (.vti)", "m", {"vtk_vti"}},
      {"vrui_grid", "Vrui text grid", "m", {"vrui_forward_grid"}},
      {"vrui_binary_grid", "Vrui binary grid", "m", {"vrui_grid"}},
      {"cave_table", "CAVE correction table", "feet", {"cave_table"}},
      {"syzygy_table", "Syzygy correction table", "feet", {"syzygy_table"}},
      {"lattice", "Lattice of arrays (.npz, .mat, .csv)", "m", {"numpy", "matlab", "lattice_csv"}}};
  return formats;
}

const CalibrationFormat* findCalibrationFormat(std::string_view id) {
  for (const CalibrationFormat& format : calibrationFormats())
    if (format.id == id) return &format;
  return nullptr;
}

const CalibrationFormat* recogniseCalibration(const std::filesystem::path& path) {
  for (const CalibrationFormat& format : calibrationFormats()) {
    const Result<const Exporter*> reader = readerFor(format, path);
    if (!reader) continue;
    const Result<LatticeField> field = (*reader)->read(path);
    if (field && check(*field, format, path.filename().string())) return &format;
  }
  return nullptr;
}

Result<Corrector> importCalibration(const CalibrationFormat& format, const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  FT_TRY(const Exporter* exporter, readerFor(format, path));
  FT_TRY(LatticeField field, exporter->read(path));
  FT_TRY_VOID(check(field, format, name));
  FT_TRY(const std::string content, readFile(path));
  if (saysTrueToMeasured(content))
    return fail(ErrorCode::kBadInput, name + " says that it takes true positions to measured ones, and a calibration " +
                                          "takes measured ones to true: write it in that direction (in 3D Slicer " +
                                          "invert the transform; here export --direction measured-to-true)");
  LatticeVectors displacements = latticeOf(field.points), turns = displacements;
  if (std::ranges::count(field.inside, 0) > 0) displacements.inside.assign(field.inside.begin(), field.inside.end());
  double squares_m2 = 0.0, n_inside = 0.0;
  for (std::size_t i = 0; i < field.displacement_m.size(); ++i) {
    const Eigen::Vector3d moved_m =
        isWithinReach(field.displacement_m[i]) ? field.displacement_m[i] : Eigen::Vector3d(Eigen::Vector3d::Zero());
    if (isInside(field, i)) {
      squares_m2 += moved_m.squaredNorm();
      n_inside += 1.0;
    }
    append(displacements.values, moved_m);
    if (field.rotation.empty()) continue;
    const bool is_turn = field.rotation[i].coeffs().allFinite();
    append(turns.values, is_turn ? rotationVector_rad(field.rotation[i]) : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  }
  const std::string note =
      "Imported from " + name + " (" + format.label + "), numbers taken as " + format.unit +
      ", measured to true, orientations " + (field.rotation.empty() ? "as they are read" : "too") +
      ", a sensor's mounting unknown; it moves positions by " + shortNumber(1000.0 * std::sqrt(squares_m2 / n_inside)) +
      " mm RMS. Its rows are points of its lattice, which nobody measured: its error is not known.";
  calibration::Evaluator::Parts parts;
  parts.position = correctors::makeImportedPosition(std::move(displacements), note);
  std::string orientation_id = "none";
  if (!field.rotation.empty()) {
    parts.orientation = correctors::makeImportedOrientation(std::move(turns));
    orientation_id = "imported";
  }
  parts.region = regionOf(field);
  return Corrector::imported(std::move(parts), {"imported", {}, orientation_id, {}}, rowsOf(field, name), {note});
}

}  // namespace fieldtrue::exporters
