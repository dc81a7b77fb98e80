#include <map>

#include "calib/archives/zip_archive.h"
#include "calib/exporters/bytes.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/lattice_arrays.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace numpy {
namespace {

/// An array in NumPy's own format, version 1.0. @param kind "<f8", "|b1", "|S12"
/// @source numpy.lib.format, format specification
std::string npy(const std::string& kind, const std::string& shape, const std::string& data) {
  constexpr std::size_t kAlign = 64;
  constexpr std::size_t kPrefix = 10;
  std::string head = "{'descr': '" + kind + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  while ((kPrefix + head.size() + 1) % kAlign != 0) head += ' ';
  head += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(head.size() & 0xffU);
  bytes += static_cast<char>(head.size() >> 8U);
  return bytes + head + data;
}

std::string doubles(const std::vector<double>& numbers) {
  std::string bytes;
  for (const double number : numbers) appendDouble(bytes, number);
  return bytes;
}

std::string vectors(const std::vector<Eigen::Vector3d>& vectors_m) {
  std::string bytes;
  for (const Eigen::Vector3d& v_m : vectors_m)
    for (const double part : v_m) appendDouble(bytes, part);
  return bytes;
}

std::vector<ZipMember> membersOf(const LatticeField& field, const Facts& facts) {
  const LatticeArrays arrays = LatticeArrays::of(field);
  std::string shape;
  for (const int count : field.points.counts) shape += (shape.empty() ? "" : ", ") + std::to_string(count);
  std::string turned, inside;
  for (const Eigen::Quaterniond& q : arrays.q)
    for (const double part : {q.w(), q.x(), q.y(), q.z()}) appendDouble(turned, part);
  for (const char one : arrays.inside) inside += static_cast<char>(one != 0 ? 1 : 0);
  std::vector<ZipMember> members;
  for (std::size_t axis = 0; axis < 3; ++axis)
    members.push_back({std::string(1, "xyz"[axis]) + "_m.npy",
                       npy("<f8", std::to_string(arrays.axes_m[axis].size()) + ",", doubles(arrays.axes_m[axis]))});
  members.push_back({"raw_m.npy", npy("<f8", shape + ", 3", vectors(arrays.raw_m))});
  members.push_back({"corrected_m.npy", npy("<f8", shape + ", 3", vectors(arrays.corrected_m))});
  members.push_back({"q_wxyz.npy", npy("<f8", shape + ", 4", turned)});
  members.push_back({"uncertainty_m.npy", npy("<f8", shape, doubles(arrays.uncertainty_m))});
  members.push_back({"inside.npy", npy("|b1", shape, inside)});
  const std::string about = factLines(facts, "");
  // What the file is can be read without unpacking it.
  members.push_back({"about.npy", npy("|S" + std::to_string(about.size()), "", about), false});
  return members;
}

Result<void> writeNpz(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  Facts all = facts;
  all.emplace_back("use", "scipy.interpolate.RegularGridInterpolator((x_m, y_m, z_m), corrected_m)");
  return writeZip(path, membersOf(field, all));
}

/// The bytes of an array of a kind in C order; empty where it is something else.
std::string dataOf(const std::string& array, const std::string& kind) {
  constexpr std::size_t kPrefix = 10;
  if (array.size() < kPrefix) return {};
  const std::size_t from = kPrefix + static_cast<unsigned char>(array[8]) + 256U * static_cast<unsigned char>(array[9]);
  const std::string head = array.substr(0, std::min(from, array.size()));
  const bool is_such = head.find("'" + kind + "'") != std::string::npos && head.find("False") != std::string::npos;
  return is_such ? array.substr(head.size()) : std::string();
}

std::vector<double> numbersOf(const std::string& array) {
  const std::string data = dataOf(array, "<f8");
  std::vector<double> numbers;
  for (std::size_t at = 0; at + 8 <= data.size(); at += 8) numbers.push_back(doubleAt(data, at));
  return numbers;
}

Result<LatticeField> readNpz(const std::filesystem::path& path) {
  const auto isNot = [&](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no lattice that can be read: " + why);
  };
  constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30U;
  auto members = readZip(path, kMostBytes);
  if (!members && members.error().code == ErrorCode::kIo) return tl::unexpected(members.error());
  if (!members) return isNot("it is no archive");
  LatticeArrays arrays;
  for (std::size_t axis = 0; axis < 3; ++axis)
    arrays.axes_m[axis] = numbersOf((*members)[std::string(1, "xyz"[axis]) + "_m.npy"]);
  const std::vector<double> corrected = numbersOf((*members)["corrected_m.npy"]);
  for (std::size_t at = 0; at + 3 <= corrected.size(); at += 3) arrays.corrected_m.emplace_back(&corrected[at]);
  const std::vector<double> turned = numbersOf((*members)["q_wxyz.npy"]);
  for (std::size_t at = 0; at + 4 <= turned.size(); at += 4)
    arrays.q.emplace_back(turned[at], turned[at + 1], turned[at + 2], turned[at + 3]);
  const std::string& inside = (*members)["inside.npy"];
  for (const char one : dataOf(inside, "|b1")) arrays.inside.push_back(one != 0 ? 1 : 0);
  if (!inside.empty() && arrays.inside.empty()) return isNot("its array inside holds no truth values");
  auto field = arrays.lattice();
  if (!field) return isNot(field.error().message);
  return field;
}

Result<Written> exportNpz(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl& control) {
  LatticeForm form = arraysForm(89.0);
  form.write = writeNpz;
  form.read = readNpz;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace numpy

Exporter numpyExporter() {
  using namespace numpy;
  return {.id = "numpy",
          .label = "Lattice (NumPy)",
          .extension = ".npz",
          .reads_it = "Python: numpy.load and SciPy's RegularGridInterpolator",
          .in_words = "metres; where measured positions (tracker frame) truly are (the calibration's frame)",
          .purpose = Purpose::kNumbers,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportNpz,
          .read = readNpz};
}

}  // namespace fieldtrue::exporters
