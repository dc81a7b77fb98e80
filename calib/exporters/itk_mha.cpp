#include <map>

#include "calib/core/file_io.h"
#include "calib/exporters/bytes.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace itk_mha {
namespace {

Result<void> writeMha(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  const ItkField itk = ItkField::of(field);
  std::string head =
      "ObjectType = Image\nNDims = 3\nComment = Displacement field by Fieldtrue; its direction and more stand below\n";
  head += "BinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n";
  // One column of the direction after the other, which MetaImage calls rows.
  head += "TransformMatrix =";
  for (int axis = 0; axis < 3; ++axis) head += " " + threeNumbers(itk.direction.col(axis));
  head += "\nOffset = " + threeNumbers(itk.origin_mm) + "\nCenterOfRotation = 0 0 0\nAnatomicalOrientation = RAI\n";
  head += "ElementSpacing = " + threeNumbers(itk.spacing_mm) + "\n";
  head += "DimSize = " + std::to_string(itk.size[0]) + " " + std::to_string(itk.size[1]) + " " +
          std::to_string(itk.size[2]) + "\n";
  // Fields of our own, which ITK keeps among the image's metadata; its comment holds 255 letters only.
  for (const auto& [key, value] : itkFacts(facts)) {
    std::string line = "Fieldtrue_";
    line.append(key).append(" = ").append(value);
    std::replace(line.begin(), line.end(), '\n', ' ');
    head += line;
    head += '\n';
  }
  head += "ElementNumberOfChannels = 3\nElementType = MET_DOUBLE\nElementDataFile = LOCAL\n";
  std::string bytes;
  for (const Eigen::Vector3d& v_mm : itk.vectors_mm)
    for (const double part_mm : v_mm) appendDouble(bytes, part_mm);
  return writeFileAtomically(path, [&](std::ostream& out) { out << head << bytes; });
}

tl::unexpected<Error> isNot(const std::filesystem::path& path, const std::string& why) {
  return fail(ErrorCode::kBadInput, path.string() + " is no displacement field that can be read: " + why);
}

Result<LatticeField> readMha(const std::filesystem::path& path) {
  FT_TRY(const auto content, readFile(path));
  std::map<std::string, std::string> tags;
  std::size_t at = 0;
  while (at < content.size() && !tags.contains("ElementDataFile")) {
    const std::size_t end = std::min(content.find('\n', at), content.size());
    std::string line = content.substr(at, std::min<std::size_t>(end - at, 1 << 16));
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::size_t sign = line.find(" = ");
    if (sign == std::string::npos) return isNot(path, "it does not begin as a MetaImage file");
    tags[line.substr(0, sign)] = line.substr(sign + 3);
  }
  if (tags["ElementDataFile"] != "LOCAL") return isNot(path, "its numbers are not in the same file");
  if (tags["CompressedData"] == "True" || tags["BinaryDataByteOrderMSB"] == "True")
    return isNot(path, "its numbers are compressed or big-endian");
  if (tags["ElementNumberOfChannels"] != "3" || tags["ElementType"] != "MET_DOUBLE")
    if (tags["ElementNumberOfChannels"] != "3" || tags["ElementType"] != "MET_FLOAT")
      return isNot(path, "its elements are not three numbers MET_DOUBLE or MET_FLOAT");
  const auto matrix = numbersIn(tags["TransformMatrix"]);
  const auto offset = numbersIn(tags["Offset"]);
  const auto spacing = numbersIn(tags["ElementSpacing"]);
  const auto sizes = numbersIn(tags["DimSize"]);
  if (!matrix || matrix->size() != 9 || !offset || offset->size() != 3 || !spacing || spacing->size() != 3 || !sizes ||
      sizes->size() != 3)
    return isNot(path, "TransformMatrix, Offset, ElementSpacing and DimSize must be those of a volume");
  ItkField itk;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    itk.size[axis] = static_cast<int>((*sizes)[axis]);
    itk.origin_mm[a] = (*offset)[axis];
    itk.spacing_mm[a] = (*spacing)[axis];
    itk.direction.col(a) = Eigen::Vector3d(&(*matrix)[3 * axis]);
  }
  const std::size_t width = tags["ElementType"] == "MET_DOUBLE" ? 8 : 4;
  for (; at + 3 * width <= content.size(); at += 3 * width) {
    Eigen::Vector3d v_mm;
    for (std::size_t axis = 0; axis < 3; ++axis)
      v_mm[static_cast<Eigen::Index>(axis)] =
          width == 8 ? doubleAt(content, at + 8 * axis) : floatAt(content, at + 4 * axis);
    itk.vectors_mm.push_back(v_mm);
  }
  auto field = itk.lattice();
  if (!field) return isNot(path, field.error().message);
  return field;
}

Result<Written> exportMha(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl& control) {
  LatticeForm form = itkForm(24.0);
  form.write = writeMha;
  form.read = readMha;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace itk_mha

Exporter itkMhaExporter() {
  using namespace itk_mha;
  return {.id = "itk_mha",
          .label = "Displacement field, MetaImage",
          .extension = ".mha",
          .reads_it = "ITK, SimpleITK, elastix, PLUS",
          .in_words = kItkWords,
          .purpose = Purpose::kSlicer,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportMha,
          .read = readMha};
}

}  // namespace fieldtrue::exporters
