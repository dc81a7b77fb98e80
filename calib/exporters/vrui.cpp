#include <cstring>

#include "calib/core/file_io.h"
#include "calib/exporters/bytes.h"
#include "calib/exporters/fixed_lattice.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/rows.h"

/// Vrui's calibrators. Both want metres: their search for a cell never ends on lattices in millimetres.
namespace fieldtrue::exporters {
namespace vrui {
namespace {

constexpr std::size_t kGridHead = 12;  ///< Three counts.
constexpr std::size_t kVertexFloats = 13;
constexpr double kForwardPitch_m = 0.012;  ///< A lattice of a strongly bent room stays within 0.1 mm with it.
constexpr double kMostForwardVertices = 4e6;

tl::unexpected<Error> isNot(const std::filesystem::path& path, const std::string& why) {
  return fail(ErrorCode::kBadInput, path.string() + " is no Vrui grid that can be read: " + why);
}

/// Calls vertex(i, j, k), the last index fastest.
template <class Vertex>
void eachVertex(const LatticePoints& points, const Vertex& vertex) {
  for (int i = 0; i < points.counts[0]; ++i)
    for (int j = 0; j < points.counts[1]; ++j)
      for (int k = 0; k < points.counts[2]; ++k) vertex(i, j, k);
}

Result<void> writeGrid(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  std::string bytes;
  for (const int count : field.points.counts) appendInt32(bytes, count);
  eachVertex(field.points, [&](int i, int j, int k) {
    const std::size_t at = field.points.at(i, j, k);
    const auto append = [&bytes](const Eigen::Vector3d& v) {
      for (const double part : v) appendFloat(bytes, static_cast<float>(part));
    };
    append(field.points.point_m(i, j, k));
    for (const float part : {0.0F, 0.0F, 0.0F, 1.0F}) appendFloat(bytes, part);
    append(field.displacement_m[at]);
    append(rotationVector_rad(field.rotation[at]));
  });
  // Behind what the reader takes.
  return writeFileAtomically(path, [&](std::ostream& out) { out << bytes << '\n' << factLines(facts); });
}

Result<LatticeField> readGrid(const std::filesystem::path& path) {
  FT_TRY(const auto bytes, readFile(path));
  if (bytes.size() < kGridHead) return isNot(path, "it is too short");
  LatticeField field;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    field.points.counts[axis] = int32At(bytes, 4 * axis);
    if (field.points.counts[axis] < 2 || field.points.counts[axis] > 100000)
      return isNot(path, "its counts must be 2 and more");
  }
  const std::size_t n = field.points.size();
  if ((bytes.size() - kGridHead) / (4 * kVertexFloats) < n) return isNot(path, "it ends before its last vertex");
  std::size_t vertex = 0;
  const auto part = [&](std::size_t which, std::size_t component) {
    return static_cast<double>(floatAt(bytes, kGridHead + 4 * (kVertexFloats * which + component)));
  };
  const auto position_m = [&](std::size_t which) {
    return Eigen::Vector3d(part(which, 0), part(which, 1), part(which, 2));
  };
  const auto nz = static_cast<std::size_t>(field.points.counts[2]);
  const std::size_t nyz = nz * static_cast<std::size_t>(field.points.counts[1]);
  field.points.origin_m = position_m(0);
  const Eigen::Vector3d last_m = position_m(n - 1);
  for (int axis = 0; axis < 3; ++axis)
    field.points.pitch_m[axis] =
        (last_m[axis] - field.points.origin_m[axis]) / (field.points.counts[static_cast<std::size_t>(axis)] - 1);
  if (!(field.points.pitch_m.minCoeff() > 0.0) || nyz == 0)
    return isNot(path, "its steps must be above 0 along every axis");
  field.displacement_m.resize(n);
  field.rotation.resize(n);
  bool is_even = true;
  eachVertex(field.points, [&](int i, int j, int k) {
    is_even = is_even && (position_m(vertex) - field.points.point_m(i, j, k)).norm() < 1e-5;
    const std::size_t at = field.points.at(i, j, k);
    field.displacement_m[at] = Eigen::Vector3d(part(vertex, 7), part(vertex, 8), part(vertex, 9));
    field.rotation[at] = rotationFromVector(Eigen::Vector3d(part(vertex, 10), part(vertex, 11), part(vertex, 12)));
    ++vertex;
  });
  if (!is_even) return isNot(path, "its vertices stand on a bent lattice; only even ones along the axes are read");
  return field;
}

Result<Written> exportGrid(const ExportSubject& subject, const ExportOptions& options,
                           const std::filesystem::path& path, const RunControl& control) {
  LatticeForm form;
  form.unit = "metres";
  form.bytes_per_point = 4.0 * kVertexFloats;
  form.with_rotation = true;
  form.write = writeGrid;
  form.read = readGrid;
  return writeLattice(subject, options, path, form, control);
}

/// A correction that Vrui applies as a rigid motion about the tracker's origin: where the text says t at a vertex v
/// with rotation R, a reading p goes to R p + (t - v). So t = v + (goes - R v) takes the vertex where it belongs.
Eigen::Vector3d storedTranslation_m(const Eigen::Vector3d& vertex_m, const Eigen::Vector3d& goes_m,
                                    const Eigen::Quaterniond& rotation) {
  return vertex_m + goes_m - rotation * vertex_m;
}

/// Between vertices translations and rotation vectors are taken to go straight.
Eigen::Vector3d forwardMapped_m(const LatticeField& field, const Eigen::Vector3d& p_m) {
  const Eigen::Vector3d steps = field.points.steps(p_m);
  std::array<int, 3> cell{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    cell[axis] = std::clamp(static_cast<int>(steps[static_cast<Eigen::Index>(axis)]), 0, field.points.counts[axis] - 2);
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero(), turn_rad = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<int, 3> at = cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double fraction = steps[static_cast<Eigen::Index>(axis)] - cell[axis];
      const bool far = ((corner >> axis) & 1) != 0;
      weight *= far ? fraction : 1.0 - fraction;
      at[axis] += far ? 1 : 0;
    }
    const std::size_t index = field.points.at(at[0], at[1], at[2]);
    const Eigen::Vector3d vertex_m = field.points.point_m(at[0], at[1], at[2]);
    const Eigen::Vector3d goes_m = vertex_m + field.displacement_m[index];
    offset_m += weight * (storedTranslation_m(vertex_m, goes_m, field.rotation[index]) - vertex_m);
    turn_rad += weight * rotationVector_rad(field.rotation[index]);
  }
  return rotationFromVector(turn_rad) * p_m + offset_m;
}

Result<void> writeForward(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  return writeFileAtomically(path, [&](std::ostream& out) {
    const LatticePoints& points = field.points;
    out << points.counts[0] << ' ' << points.counts[1] << ' ' << points.counts[2] << '\n'
        << threeNumbers(points.origin_m) << '\n'
        << threeNumbers(points.pitch_m) << '\n';
    eachVertex(points, [&](int i, int j, int k) {
      const std::size_t at = points.at(i, j, k);
      const Eigen::Vector3d vertex_m = points.point_m(i, j, k);
      const Eigen::Quaterniond& q = field.rotation[at];
      const Eigen::Vector3d turn_rad = rotationVector_rad(q);
      const double angle_rad = turn_rad.norm();
      const Eigen::Vector3d axis = angle_rad > 0.0 ? Eigen::Vector3d(turn_rad / angle_rad) : Eigen::Vector3d::UnitX();
      const Eigen::Vector3d t_m = storedTranslation_m(vertex_m, vertex_m + field.displacement_m[at], q);
      out << "V {{" << threeNumbers(t_m, ", ") << "}, {{" << threeNumbers(axis, ", ") << "}, "
          << formatNumber(angle_rad) << "}}\n";
    });
    out << factLines(facts);
  });
}

Result<LatticeField> readForward(const std::filesystem::path& path) {
  FT_TRY(const auto content, readFile(path));
  std::string text = content.substr(0, content.find('#'));
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == 'I') return isNot(path, "it has an invalid vertex; only full grids are read");
    if (text[at] == 'V') text[at] = ' ';
  }
  const auto numbers = numbersIn(text);
  if (!numbers) return isNot(path, numbers.error().message);
  constexpr std::size_t kHead = 9, kVertex = 7;
  if (numbers->size() < kHead) return isNot(path, "its head needs nine numbers");
  LatticeField field;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    if (!((*numbers)[axis] >= 2.0 && (*numbers)[axis] < 1e5)) return isNot(path, "its counts must be 2 and more");
    field.points.counts[axis] = static_cast<int>((*numbers)[axis]);
    field.points.origin_m[a] = (*numbers)[3 + axis];
    field.points.pitch_m[a] = (*numbers)[6 + axis];
  }
  if (!(field.points.pitch_m.minCoeff() > 0.0)) return isNot(path, "its cells must be above 0 along every axis");
  const std::size_t n = field.points.size();
  if (numbers->size() != kHead + kVertex * n) return isNot(path, "it does not hold seven numbers a vertex");
  field.displacement_m.resize(n);
  field.rotation.resize(n);
  std::size_t vertex = 0;
  eachVertex(field.points, [&](int i, int j, int k) {
    const double* v = &(*numbers)[kHead + kVertex * vertex++];
    const std::size_t at = field.points.at(i, j, k);
    const Eigen::Vector3d vertex_m = field.points.point_m(i, j, k);
    field.rotation[at] = rotationFromVector(v[6] * Eigen::Vector3d(v[3], v[4], v[5]));
    field.displacement_m[at] =
        field.rotation[at] * vertex_m + (Eigen::Vector3d(v[0], v[1], v[2]) - vertex_m) - vertex_m;
  });
  return field;
}

Result<Written> exportForward(const ExportSubject& subject, const ExportOptions& options,
                              const std::filesystem::path& path, const RunControl& control) {
  LatticeForm form;
  form.unit = "metres";
  form.with_rotation = true;
  form.write = writeForward;
  form.read = readForward;
  form.mapped_m = forwardMapped_m;
  Eigen::Vector3d pitch_m = Eigen::Vector3d::Constant(kForwardPitch_m);
  LatticePoints points = latticeAround(subject, Eigen::Matrix3d::Identity(), pitch_m, 2);
  const double bytes = 150.0 * static_cast<double>(points.size());
  const double most = std::min(options.max_size_bytes / 150.0, kMostForwardVertices);
  if (bytes > 150.0 * most) {
    pitch_m *= std::cbrt(1.1 * static_cast<double>(points.size()) / most);
    points = latticeAround(subject, Eigen::Matrix3d::Identity(), pitch_m, 2);
  }
  FT_TRY(auto written, writeFixedLattice(subject, options, path, points, form, "A Vrui forward grid", control));
  subject.tellOfTurns(written);
  if (subject.correctsOrientation())
    written.notes.emplace_back(
        "Vrui turns a reading about the tracker's origin, so that between vertices positions are a "
        "little off where orientation is corrected too.");
  return written;
}

}  // namespace
}  // namespace vrui

Exporter vruiForwardGridExporter() {
  using namespace vrui;
  return {.id = "vrui_forward_grid",
          .label = "Vrui forward grid (text)",
          .extension = ".vrui.txt",
          .reads_it = "Vrui: section of type ForwardGridCalibrator, calibrationFileName",
          .in_words = "metres; measured (tracker frame) to true (the calibration's frame), with orientation",
          .purpose = Purpose::kVrui,
          .write = exportForward,
          .read = readForward};
}

Exporter vruiGridExporter() {
  using namespace vrui;
  return {.id = "vrui_grid",
          .label = "Vrui grid (binary)",
          .extension = ".vrui.grid",
          .reads_it = "Vrui: section of type GridCalibrator",
          .in_words = "metres; measured (tracker frame) to true (the calibration's frame), with orientation",
          .purpose = Purpose::kVrui,
          .has_free_pitch = true,
          .write = exportGrid,
          .read = readGrid};
}

}  // namespace fieldtrue::exporters
