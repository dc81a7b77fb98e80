#include <sstream>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/exporters/fixed_lattice.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/rows.h"

/// Tables of the CAVE's time, in feet. Their readers run past the end of the table at its upper bounds, so that two
/// steps of padding stand around the places.
namespace fieldtrue::exporters {
namespace period_tables {
namespace {

constexpr int kCavePadding = 1;
constexpr int kSyzygyPadding = 2;

std::string feet(double length_m) { return formatNumber(length_m / kFoot_m); }

tl::unexpected<Error> isNot(const std::filesystem::path& path, const std::string& why) {
  return fail(ErrorCode::kBadInput, path.string() + " is no table that can be read: " + why);
}

Result<std::vector<double>> numbersOfFile(const std::filesystem::path& path) {
  FT_TRY(const auto content, readFile(path));
  auto numbers = numbersIn(content.substr(0, content.find('#')));
  if (!numbers) return isNot(path, numbers.error().message);
  return numbers;
}

Result<void> writeCave(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  const LatticePoints& points = field.points;
  return writeFileAtomically(path, [&](std::ostream& out) {
    const Eigen::Vector3d last_m = points.point_m(points.size() - 1);
    for (int axis = 0; axis < 3; ++axis) out << feet(points.origin_m[axis]) << ' ' << feet(last_m[axis]) << '\n';
    for (int i = 0; i < points.counts[0]; ++i)
      for (int j = 0; j < points.counts[1]; ++j)
        for (int k = 0; k < points.counts[2]; ++k) {
          const Eigen::Vector3d p_m = points.point_m(i, j, k);
          out << threeNumbers(p_m / kFoot_m) << ' '
              << threeNumbers((p_m + field.displacement_m[points.at(i, j, k)]) / kFoot_m) << '\n';
        }
    // Readers stop after the last row.
    out << factLines(facts);
  });
}

Result<LatticeField> readCave(const std::filesystem::path& path) {
  const auto numbers = numbersOfFile(path);
  if (!numbers) return tl::unexpected(numbers.error());
  constexpr std::size_t kBounds = 6;
  if (numbers->size() < kBounds + 8 * 6 || (numbers->size() - kBounds) % 6 != 0)
    return isNot(path, "it needs three pairs of bounds and six numbers a row");
  const std::size_t n = (numbers->size() - kBounds) / 6;
  const auto raw = [&](std::size_t row) -> Eigen::Vector3d {
    return kFoot_m * Eigen::Vector3d(&(*numbers)[kBounds + 6 * row]);
  };
  LatticeField field;
  field.points.origin_m = raw(0);
  // z runs fastest: rows until z, then y, begins anew.
  std::size_t nz = 1, nyz = 1;
  while (nz < n && raw(nz).z() > raw(nz - 1).z()) ++nz;
  nyz = nz;
  while (nyz < n && raw(nyz).y() > raw(nyz - nz).y()) nyz += nz;
  if (nz < 2 || nyz < 2 * nz || n % nyz != 0 || n / nyz < 2)
    return isNot(path, "its rows do not fill a lattice, z fastest");
  field.points.counts = {static_cast<int>(n / nyz), static_cast<int>(nyz / nz), static_cast<int>(nz)};
  field.points.pitch_m = Eigen::Vector3d(raw(nyz).x() - raw(0).x(), raw(nz).y() - raw(0).y(), raw(1).z() - raw(0).z());
  if (!(field.points.pitch_m.minCoeff() > 0.0)) return isNot(path, "its steps must be above 0 along every axis");
  field.displacement_m.resize(n);
  std::size_t row = 0;
  for (int i = 0; i < field.points.counts[0]; ++i)
    for (int j = 0; j < field.points.counts[1]; ++j)
      for (int k = 0; k < field.points.counts[2]; ++k, ++row) {
        if ((raw(row) - field.points.point_m(i, j, k)).norm() > 1e-6)
          return isNot(path, "row " + std::to_string(row + 1) + " does not stand on an even lattice");
        field.displacement_m[field.points.at(i, j, k)] =
            Eigen::Vector3d(&(*numbers)[kBounds + 6 * row + 3]) * kFoot_m - raw(row);
      }
  return field;
}

Result<Written> exportCave(const ExportSubject& subject, const ExportOptions& options,
                           const std::filesystem::path& path, const RunControl& control) {
  LatticeForm form;
  form.unit = "feet";
  form.write = writeCave;
  form.read = readCave;
  // Old readers take the step for one foot and the bounds for whole feet.
  const LatticePoints points =
      latticeAround(subject, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Constant(kFoot_m), kCavePadding, true);
  return writeFixedLattice(subject, options, path, points, form, "A CAVE table, whose step is one foot,", control);
}

Result<void> writeSyzygy(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  const LatticePoints& points = field.points;
  return writeFileAtomically(path, [&](std::ostream& out) {
    for (int axis = 0; axis < 3; ++axis)
      out << points.counts[static_cast<std::size_t>(axis)] << ' ' << feet(points.origin_m[axis]) << ' '
          << feet(points.pitch_m[axis]) << (axis < 2 ? " " : "\n");
    for (int axis = 0; axis < 3; ++axis)
      for (std::size_t at = 0; at < points.size(); ++at)
        out << feet(points.point_m(at)[axis] + field.displacement_m[at][axis]) << '\n';
    out << factLines(facts);
  });
}

Result<LatticeField> readSyzygy(const std::filesystem::path& path) {
  const auto numbers = numbersOfFile(path);
  if (!numbers) return tl::unexpected(numbers.error());
  constexpr std::size_t kHead = 9;
  if (numbers->size() < kHead) return isNot(path, "its head needs nine numbers");
  LatticeField field;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double count = (*numbers)[3 * axis];
    if (!(count >= 2.0 && count < 1e5)) return isNot(path, "its counts must be 2 and more");
    field.points.counts[axis] = static_cast<int>(count);
    field.points.origin_m[a] = (*numbers)[3 * axis + 1] * kFoot_m;
    field.points.pitch_m[a] = (*numbers)[3 * axis + 2] * kFoot_m;
  }
  const std::size_t n = field.points.size();
  if (numbers->size() != kHead + 3 * n) return isNot(path, "it does not hold three numbers a point");
  for (std::size_t at = 0; at < n; ++at) {
    const Eigen::Vector3d goes_m =
        kFoot_m * Eigen::Vector3d((*numbers)[kHead + at], (*numbers)[kHead + n + at], (*numbers)[kHead + 2 * n + at]);
    field.displacement_m.emplace_back(goes_m - field.points.point_m(at));
  }
  return field;
}

Result<Written> exportSyzygy(const ExportSubject& subject, const ExportOptions& options,
                             const std::filesystem::path& path, const RunControl& control) {
  LatticeForm form;
  form.unit = "feet";
  form.write = writeSyzygy;
  form.read = readSyzygy;
  constexpr double kStep_m = 0.5 * kFoot_m;
  const LatticePoints points =
      latticeAround(subject, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Constant(kStep_m), kSyzygyPadding, true);
  return writeFixedLattice(subject, options, path, points, form, "A Syzygy table of half a foot", control);
}

}  // namespace
}  // namespace period_tables

Exporter caveTableExporter() {
  using namespace period_tables;
  return {.id = "cave_table",
          .label = "CAVE calibration table",
          .extension = ".cave.txt",
          .reads_it = "CAVELib, old VR Juggler drivers",
          .in_words = "feet, steps of one foot; measured (tracker frame) to true (the calibration's frame)",
          .purpose = Purpose::kPeriod,
          .write = exportCave,
          .read = readCave};
}

Exporter syzygyTableExporter() {
  using namespace period_tables;
  return {.id = "syzygy_table",
          .label = "Syzygy table",
          .extension = ".syzygy.txt",
          .reads_it = "Syzygy (arTrackCalFilter)",
          .in_words = "feet, steps of half a foot; measured (tracker frame) to true (the calibration's frame)",
          .purpose = Purpose::kPeriod,
          .write = exportSyzygy,
          .read = readSyzygy};
}

}  // namespace fieldtrue::exporters
