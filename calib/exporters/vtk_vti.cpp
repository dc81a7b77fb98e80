#include "calib/core/file_io.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/lattice_export.h"
#include "calib/exporters/rows.h"
#include "calib/exporters/vtk_xml.h"

namespace fieldtrue::exporters {
namespace vtk_vti {
namespace {

Result<void> writeVti(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  Facts all = facts;
  all.emplace_back("outside", "vtkGridTransform takes the value of the nearest edge");
  std::string extent;
  for (const int count : field.points.counts) extent += (extent.empty() ? "0 " : " 0 ") + std::to_string(count - 1);
  std::string text = vtkHead("ImageData", all);
  text += "<ImageData WholeExtent=\"" + extent + "\" Origin=\"" + threeNumbers(field.points.origin_m) +
          "\" Spacing=\"" + threeNumbers(field.points.pitch_m) + "\">\n<Piece Extent=\"" + extent +
          "\">\n<PointData Vectors=\"displacement_m\">\n" + vtkArray("displacement_m", field.displacement_m);
  if (!field.uncertainty_m.empty() && std::any_of(field.uncertainty_m.begin(), field.uncertainty_m.end(),
                                                  [](double u_m) { return std::isfinite(u_m); }))
    text += vtkArray("uncertainty_m", 1, field.uncertainty_m);
  if (!field.inside.empty()) text += vtkArray("inside", 1, {field.inside.begin(), field.inside.end()});
  text += "</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n";
  return writeFileAtomically(path, [&](std::ostream& out) { out << text; });
}

Result<LatticeField> readVti(const std::filesystem::path& path) {
  const auto isNot = [&](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no displacement field that can be read: " + why);
  };
  FT_TRY(const auto content, readFile(path));
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(content.data(), content.size());
  if (!parsed) return isNot(std::string("it is no XML: ") + parsed.description());
  const pugi::xml_node root = document.child("VTKFile"), image = root.child("ImageData");
  if (!image) return isNot("it holds no ImageData");
  const pugi::xml_node data = image.child("Piece").child("PointData");
  pugi::xml_node array, inside;
  const std::string named = data.attribute("Vectors").as_string();
  for (const pugi::xml_node& one : data.children("DataArray")) {
    const bool is_vector = one.attribute("NumberOfComponents").as_int(1) == 3;
    if (is_vector && (!array || named == one.attribute("Name").as_string())) array = one;
    if (!is_vector && std::string_view(one.attribute("Name").as_string()) == "inside") inside = one;
  }
  if (!array) return isNot("it holds no array of three-vectors at its points");
  const auto extent = numbersIn(image.attribute("WholeExtent").as_string());
  const auto origin = numbersIn(image.attribute("Origin").as_string("0 0 0"));
  const auto spacing = numbersIn(image.attribute("Spacing").as_string("1 1 1"));
  const auto direction = numbersIn(image.attribute("Direction").as_string("1 0 0 0 1 0 0 0 1"));
  if (!extent || extent->size() != 6 || !origin || origin->size() != 3 || !spacing || spacing->size() != 3 ||
      !direction || direction->size() != 9)
    return isNot("WholeExtent, Origin, Spacing and Direction must be those of a volume");
  LatticeField field;
  Eigen::Vector3d first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    field.points.counts[axis] = 1 + static_cast<int>((*extent)[2 * axis + 1] - (*extent)[2 * axis]);
    field.points.pitch_m[a] = (*spacing)[axis];
    first[a] = (*extent)[2 * axis] * (*spacing)[axis];
    for (std::size_t column = 0; column < 3; ++column)
      field.points.axes(a, static_cast<Eigen::Index>(column)) = (*direction)[3 * axis + column];
  }
  if (!(field.points.pitch_m.minCoeff() > 0.0)) return isNot("its spacing must be above 0 along every axis");
  field.points.origin_m = Eigen::Vector3d(origin->data()) + field.points.axes * first;
  const auto numbers = vtkNumbers(root, array);
  if (!numbers) return isNot(numbers.error().message);
  if (field.points.counts[0] < 2 || field.points.counts[1] < 2 || field.points.counts[2] < 2 ||
      numbers->size() != 3 * field.points.size())
    return isNot("its extent does not match the " + std::to_string(numbers->size()) + " numbers it holds");
  for (std::size_t at = 0; at < numbers->size(); at += 3) field.displacement_m.emplace_back(&(*numbers)[at]);
  if (!inside) return field;
  const auto marks = vtkNumbers(root, inside);
  if (!marks) return isNot(marks.error().message);
  if (marks->size() != field.points.size())
    return isNot("its array inside holds " + std::to_string(marks->size()) + " numbers for " +
                 std::to_string(field.points.size()) + " points");
  for (const double mark : *marks) field.inside.push_back(mark != 0.0 ? 1 : 0);
  return field;
}

Result<Written> exportVti(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl& control) {
  LatticeForm form;
  form.unit = "metres";
  form.bytes_per_point = 5.0 * 8.0 * 4.0 / 3.0;
  form.with_uncertainty = true;
  form.write = writeVti;
  form.read = readVti;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace vtk_vti

Exporter vtkVtiExporter() {
  using namespace vtk_vti;
  return {.id = "vtk_vti",
          .label = "Displacement field, VTK image",
          .extension = ".vti",
          .reads_it = "ParaView, VTK (vtkGridTransform), PyVista",
          .in_words = "metres; points move from measured (tracker frame) to true (the calibration's frame)",
          .purpose = Purpose::kParaView,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportVti,
          .read = readVti};
}

}  // namespace fieldtrue::exporters
