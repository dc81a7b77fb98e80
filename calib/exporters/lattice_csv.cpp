#include <charconv>
#include <set>

#include "calib/core/file_io.h"
#include "calib/exporters/lattice_arrays.h"
#include "calib/exporters/lattice_export.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace lattice_csv {
namespace {

constexpr const char* kColumns =
    "x_m,y_m,z_m,x_corrected_m,y_corrected_m,z_corrected_m,qw,qx,qy,qz,uncertainty_m,inside\n";

Result<void> writeCsv(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  Facts all = facts;
  all.emplace_back("order", "z fastest; qw qx qy qz turn what the tracker reads: q_true = q * q_tracked");
  return writeFileAtomically(path, [&](std::ostream& out) {
    out << factLines(all) << kColumns;
    const LatticePoints& points = field.points;
    for (int i = 0; i < points.counts[0]; ++i)
      for (int j = 0; j < points.counts[1]; ++j)
        for (int k = 0; k < points.counts[2]; ++k) {
          const std::size_t at = points.at(i, j, k);
          const Eigen::Vector3d p_m = points.point_m(i, j, k);
          const Eigen::Vector3d goes_m = p_m + field.displacement_m[at];
          const Eigen::Quaterniond& q = field.rotation[at];
          std::string line;
          for (const double number :
               {p_m.x(), p_m.y(), p_m.z(), goes_m.x(), goes_m.y(), goes_m.z(), q.w(), q.x(), q.y(), q.z()}) {
            line += formatNumber(number);
            line += ',';
          }
          if (std::isfinite(field.uncertainty_m[at])) line += formatNumber(field.uncertainty_m[at]);
          out << line << (field.inside[at] != 0 ? ",1\n" : ",0\n");
        }
  });
}

Result<LatticeField> readCsv(const std::filesystem::path& path) {
  FT_TRY(const auto content, readFile(path));
  const auto isNot = [&](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no lattice that can be read: " + why);
  };
  std::size_t at = content.find(kColumns);
  if (at == std::string::npos) return isNot(std::string("it has no line ") + kColumns);
  at += std::string(kColumns).size();
  LatticeArrays arrays;
  std::vector<Eigen::Vector3d> raw_m;
  while (at < content.size()) {
    std::array<double, 10> numbers{};
    for (double& number : numbers) {
      const auto read = std::from_chars(content.data() + at, content.data() + content.size(), number);
      if (read.ec != std::errc()) return isNot("row " + std::to_string(raw_m.size() + 1) + " is no list of numbers");
      at = static_cast<std::size_t>(read.ptr - content.data()) + 1;
    }
    raw_m.emplace_back(numbers[0], numbers[1], numbers[2]);
    arrays.corrected_m.emplace_back(numbers[3], numbers[4], numbers[5]);
    arrays.q.emplace_back(numbers[6], numbers[7], numbers[8], numbers[9]);
    const std::size_t end = std::min(content.find('\n', at), content.size());
    const std::string_view rest =
        std::string_view(content).substr(at, end - at);  // Uncertainty, which may be blank, and inside.
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view inside = rest.substr(std::min(comma + 1, rest.size()), 1);
    if (inside != "0" && inside != "1")
      return isNot("row " + std::to_string(raw_m.size()) + " says neither 0 nor 1 under inside");
    arrays.inside.push_back(inside == "1" ? 1 : 0);
    at = end + 1;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::set<double> levels;
    for (const Eigen::Vector3d& p_m : raw_m) levels.insert(p_m[static_cast<Eigen::Index>(axis)]);
    arrays.axes_m[axis].assign(levels.begin(), levels.end());
  }
  auto field = arrays.lattice();
  if (!field) return isNot(field.error().message);
  return field;
}

Result<Written> exportCsv(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl& control) {
  LatticeForm form = arraysForm(180.0);
  form.write = writeCsv;
  form.read = readCsv;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace lattice_csv

Exporter latticeCsvExporter() {
  using namespace lattice_csv;
  return {.id = "lattice_csv",
          .label = "Lattice (CSV)",
          .extension = ".lattice.csv",
          .reads_it = "spreadsheets, Python, R, MATLAB, any program",
          .in_words = "metres; where measured positions (tracker frame) truly are (the calibration's frame)",
          .purpose = Purpose::kNumbers,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportCsv,
          .read = readCsv};
}

}  // namespace fieldtrue::exporters
