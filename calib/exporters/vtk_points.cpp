#include <set>

#include "calib/core/file_io.h"
#include "calib/exporters/lattice_export.h"
#include "calib/exporters/rows.h"
#include "calib/exporters/vtk_xml.h"

namespace fieldtrue::exporters {
namespace vtk_points {
namespace {

/// One point a vertex, which is what ParaView shows without a filter.
std::string verticesOf(std::size_t n) {
  std::vector<std::int64_t> points, ends;
  for (std::size_t i = 0; i < n; ++i) {
    points.push_back(static_cast<std::int64_t>(i));
    ends.push_back(static_cast<std::int64_t>(i) + 1);
  }
  return "<Verts>\n" + vtkIntegers("connectivity", points) + vtkIntegers("offsets", ends) + "</Verts>\n";
}

Result<void> writePoints(const std::filesystem::path& path, const Facts& facts,
                         const std::vector<Eigen::Vector3d>& points_m, const std::string& attributes,
                         const std::string& arrays) {
  const std::string n = std::to_string(points_m.size());
  const std::string text = vtkHead("PolyData", facts) + "<PolyData>\n<Piece NumberOfPoints=\"" + n +
                           "\" NumberOfVerts=\"" + n +
                           "\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n<PointData" + attributes +
                           ">\n" + arrays + "</PointData>\n<Points>\n" + vtkArray("Points", points_m) + "</Points>\n" +
                           verticesOf(points_m.size()) + "</Piece>\n</PolyData>\n</VTKFile>\n";
  return writeFileAtomically(path, [&](std::ostream& out) { out << text; });
}

/// Rows that measured at the same spot count once: a spline cannot pass through two values there.
Result<Written> writeLandmarks(const ExportSubject& subject, const ExportOptions&, const std::filesystem::path& path,
                               const RunControl&) {
  std::set<std::array<double, 3>> seen;
  std::vector<Eigen::Vector3d> source_m, target_m;
  for (const Eigen::Vector3d& p_m : subject.places_m()) {
    if (!seen.insert({p_m.x(), p_m.y(), p_m.z()}).second) continue;
    source_m.push_back(p_m);
    target_m.push_back(subject.mapped_m(p_m));
  }
  if (source_m.size() < 4 || pointSpread(source_m).dimension < 3)
    return fail(ErrorCode::kDegenerate, "A thin-plate spline needs four places that span a volume; these " +
                                            std::to_string(source_m.size()) + " do not");
  Facts facts = subject.facts("metres");
  facts.emplace_back("use",
                     "vtkThinPlateSplineTransform with basis R: points = source landmarks, array target_m = target "
                     "landmarks; exact at the places, a spline of its own between them");
  FT_TRY_VOID(writePoints(path, facts, source_m, " Vectors=\"target_m\"", vtkArray("target_m", target_m)));
  Written written;
  written.notes.push_back(std::to_string(source_m.size()) +
                          " pairs. Exact at these places; between them the spline goes its own way.");
  return written;
}

Result<Written> writePlaces(const ExportSubject& subject, const ExportOptions&, const std::filesystem::path& path,
                            const RunControl&) {
  const calibration::Corrector& corrector = subject.corrector();
  std::vector<Eigen::Vector3d> true_m, tracked_m, before_m, after_m;
  std::vector<double> node, sensor, visit, before_norm_m, after_norm_m, uncertainty_m;
  for (const Node& row : corrector.table().nodes) {
    const Pose& tracked = row.tracker_from_sensor;
    const Eigen::Vector3d& p_true_m = row.reference_from_sensor.position_m;
    true_m.push_back(p_true_m);
    tracked_m.push_back(tracked.position_m);
    before_m.emplace_back(corrector.alignment().reference_from_tracker * tracked.position_m - p_true_m);
    after_m.emplace_back(corrector.correct(tracked, row.sensor).position_m - p_true_m);
    before_norm_m.push_back(before_m.back().norm());
    after_norm_m.push_back(after_m.back().norm());
    node.push_back(row.node);
    sensor.push_back(row.sensor);
    visit.push_back(row.visit);
    uncertainty_m.push_back(corrector.uncertaintyAt_m(tracked, row.sensor).value_or(std::nan("")));
  }
  Facts facts = subject.facts("metres");
  facts.emplace_back("points", "true positions, in the calibration's frame");
  facts.emplace_back("errors", "measured less true, before and after correction, in-sample");
  std::string arrays = vtkArray("error_before_m", before_m) + vtkArray("error_after_m", after_m) +
                       vtkArray("tracked_m", tracked_m) + vtkArray("error_before_length_m", 1, before_norm_m) +
                       vtkArray("error_after_length_m", 1, after_norm_m) + vtkArray("node", 1, node) +
                       vtkArray("sensor", 1, sensor) + vtkArray("visit", 1, visit);
  if (std::isfinite(uncertainty_m.front())) arrays += vtkArray("uncertainty_m", 1, uncertainty_m);
  FT_TRY_VOID(
      writePoints(path, facts, true_m, " Vectors=\"error_before_m\" Scalars=\"error_before_length_m\"", arrays));
  Written written;
  written.notes.push_back(std::to_string(true_m.size()) + " rows.");
  return written;
}

}  // namespace
}  // namespace vtk_points

Exporter vtkLandmarksExporter() {
  using namespace vtk_points;
  return {.id = "vtk_landmarks",
          .label = "Landmarks of a thin-plate spline",
          .extension = ".landmarks.vtp",
          .reads_it = "VTK (vtkThinPlateSplineTransform), ParaView",
          .in_words = "metres; points = measured (tracker frame), array target_m = where the calibration takes them",
          .purpose = Purpose::kParaView,
          .may_be_inverse = true,
          .write = writeLandmarks};
}

Exporter vtkVtpExporter() {
  using namespace vtk_points;
  return {.id = "vtk_vtp",
          .label = "Places with their errors",
          .extension = ".vtp",
          .reads_it = "ParaView, VTK, PyVista",
          .in_words = "metres; points = true positions, arrays = errors before and after correction",
          .purpose = Purpose::kParaView,
          .knows_pose = true,
          .write = writePlaces};
}

}  // namespace fieldtrue::exporters
