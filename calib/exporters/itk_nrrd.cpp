#include <map>

#include "calib/core/file_io.h"
#include "calib/exporters/bytes.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace itk_nrrd {
namespace {

std::string tuple(const Eigen::Vector3d& v) { return "(" + threeNumbers(v, ",") + ")"; }

std::string oneLine(std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  return text;
}

Result<void> writeNrrd(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  const ItkField itk = ItkField::of(field);
  std::string head = "NRRD0005\n# Displacement field by Fieldtrue: where the tracker's positions truly are\n";
  head += "type: double\ndimension: 4\nspace: left-posterior-superior\n";
  head += "sizes: 3 " + std::to_string(itk.size[0]) + " " + std::to_string(itk.size[1]) + " " +
          std::to_string(itk.size[2]) + "\n";
  head += "space directions: none";
  for (int axis = 0; axis < 3; ++axis)
    head += " " + tuple(Eigen::Vector3d(itk.spacing_mm[axis] * itk.direction.col(axis)));
  head += "\nkinds: vector domain domain domain\nendian: little\nencoding: gzip\n";
  head += "space origin: " + tuple(itk.origin_mm) + "\n";
  // 3D Slicer's key for fields that move points.
  bool is_inverse = false;
  for (const auto& [key, value] : facts)
    is_inverse = is_inverse || (key == "direction" && value == directionText(Direction::kTrueToMeasured));
  head += std::string("displacement field type:=") + (is_inverse ? "resampling" : "modeling") + "\n";
  for (const auto& [key, value] : itkFacts(facts)) {
    head += "fieldtrue.";
    head += key;
    head += ":=";
    head += oneLine(value);
    head += '\n';
  }
  std::string bytes;
  for (const Eigen::Vector3d& v_mm : itk.vectors_mm)
    for (const double part_mm : v_mm) appendDouble(bytes, part_mm);
  const std::string packed = gzipped(bytes);
  return writeFileAtomically(path, [&](std::ostream& out) { out << head << '\n' << packed; });
}

tl::unexpected<Error> isNot(const std::filesystem::path& path, const std::string& why) {
  return fail(ErrorCode::kBadInput, path.string() + " is no displacement field that can be read: " + why);
}

/// The lines of the head by key, keys and values apart by ": " or ":=".
std::map<std::string, std::string> fieldsOf(const std::string& head) {
  std::map<std::string, std::string> fields;
  std::size_t from = 0;
  while (from < head.size()) {
    const std::size_t end = std::min(head.find('\n', from), head.size());
    std::string line = head.substr(from, end - from);
    from = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::size_t colon = line.find(':');
    if (line.starts_with('#') || colon == std::string::npos || colon + 1 >= line.size()) continue;
    const std::size_t value = line.find_first_not_of(" =", colon + 1);
    fields[line.substr(0, colon)] = value == std::string::npos ? "" : line.substr(value);
  }
  return fields;
}

Result<LatticeField> readNrrd(const std::filesystem::path& path) {
  FT_TRY(const auto content, readFile(path));
  const std::size_t split = content.find("\n\n");
  if (!content.starts_with("NRRD") || split == std::string::npos)
    return isNot(path, "it does not begin as a NRRD file");
  auto fields = fieldsOf(content.substr(0, split));
  if (fields["type"] != "double" && fields["type"] != "float")
    return isNot(path, "its type is '" + fields["type"] + "', not double or float");
  if (fields["endian"] == "big") return isNot(path, "its numbers are big-endian");
  const auto sizes = numbersIn(fields["sizes"]);
  std::string directions = fields["space directions"];
  if (!directions.starts_with("none")) return isNot(path, "its first axis does not hold the vectors");
  const auto steps = numbersIn(directions.substr(4));
  const auto origin = numbersIn(fields["space origin"]);
  if (!sizes || sizes->size() != 4 || (*sizes)[0] != 3.0 || !steps || steps->size() != 9 || !origin ||
      origin->size() != 3)
    return isNot(path, "sizes, space directions and space origin must be those of three-vectors in a volume");
  const double sign = fields["space"] == "right-anterior-superior" || fields["space"] == "RAS" ? -1.0 : 1.0;
  if (sign > 0.0 && fields["space"] != "left-posterior-superior" && fields["space"] != "LPS")
    return isNot(path,
                 "its space is '" + fields["space"] + "', neither left-posterior-superior nor right-anterior-superior");
  const Eigen::Vector3d to_lps(sign, sign, 1.0);
  ItkField itk;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    itk.size[axis] = static_cast<int>((*sizes)[axis + 1]);
    const Eigen::Vector3d step_mm = to_lps.cwiseProduct(Eigen::Vector3d(&(*steps)[3 * axis]));
    itk.spacing_mm[a] = step_mm.norm();
    itk.direction.col(a) = step_mm.normalized();
    itk.origin_mm[a] = to_lps[a] * (*origin)[axis];
  }
  std::string bytes = content.substr(split + 2);
  if (fields["encoding"] == "gzip" || fields["encoding"] == "gz") {
    auto plain = inflated(bytes);
    if (!plain) return isNot(path, plain.error().message);
    bytes = *std::move(plain);
  } else if (fields["encoding"] != "raw") {
    return isNot(path, "its encoding is '" + fields["encoding"] + "', neither raw nor gzip");
  }
  const std::size_t width = fields["type"] == "double" ? 8 : 4;
  for (std::size_t at = 0; at + 3 * width <= bytes.size(); at += 3 * width) {
    Eigen::Vector3d v_mm;
    for (std::size_t axis = 0; axis < 3; ++axis)
      v_mm[static_cast<Eigen::Index>(axis)] =
          width == 8 ? doubleAt(bytes, at + 8 * axis) : floatAt(bytes, at + 4 * axis);
    itk.vectors_mm.emplace_back(to_lps.cwiseProduct(v_mm));
  }
  auto field = itk.lattice();
  if (!field) return isNot(path, field.error().message);
  return field;
}

Result<Written> exportNrrd(const ExportSubject& subject, const ExportOptions& options,
                           const std::filesystem::path& path, const RunControl& control) {
  LatticeForm form = itkForm(24.0);
  form.write = writeNrrd;
  form.read = readNrrd;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace itk_nrrd

Exporter itkNrrdExporter() {
  using namespace itk_nrrd;
  return {.id = "itk_nrrd",
          .label = "Displacement field, NRRD",
          .extension = ".nrrd",
          .reads_it = "3D Slicer (as a transform that moves points), ITK, teem",
          .in_words = kItkWords,
          .purpose = Purpose::kSlicer,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportNrrd,
          .read = readNrrd};
}

}  // namespace fieldtrue::exporters
