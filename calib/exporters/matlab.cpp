#include <matio.h>

#include <memory>

#include "calib/core/file_io.h"
#include "calib/exporters/bytes.h"
#include "calib/exporters/lattice_arrays.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace matlab {
namespace {

bool addArray(mat_t* file, const char* name, std::vector<std::size_t> dims, std::vector<double> numbers) {
  matvar_t* variable = Mat_VarCreate(name, MAT_C_DOUBLE, MAT_T_DOUBLE, static_cast<int>(dims.size()), dims.data(),
                                     numbers.data(), MAT_F_DONT_COPY_DATA);
  if (variable == nullptr) return false;
  const bool good = Mat_VarWrite(file, variable, MAT_COMPRESSION_ZLIB) == 0;
  Mat_VarFree(variable);
  return good;
}

bool addText(mat_t* file, const char* name, std::string text) {
  std::array<std::size_t, 2> dims = {1, text.size()};
  matvar_t* variable = Mat_VarCreate(name, MAT_C_CHAR, MAT_T_UINT8, 2, dims.data(), text.data(), MAT_F_DONT_COPY_DATA);
  if (variable == nullptr) return false;
  const bool good = Mat_VarWrite(file, variable, MAT_COMPRESSION_NONE) == 0;
  Mat_VarFree(variable);
  return good;
}

/// One component after the other, x fastest in each: MATLAB's order of an array of size nx, ny, nz, n.
template <class Of>
std::vector<double> byComponent(const LatticeField& field, std::size_t n, const Of& of) {
  std::vector<double> numbers;
  numbers.reserve(n * field.points.size());
  for (std::size_t component = 0; component < n; ++component)
    for (std::size_t at = 0; at < field.points.size(); ++at) numbers.push_back(of(at, component));
  return numbers;
}

bool fillMat(const std::filesystem::path& path, const LatticeField& field, const Facts& facts) {
  // A header of our own, for matio's holds the time.
  mat_t* file = Mat_CreateVer(path.c_str(), "MATLAB 5.0 MAT-file, written by Fieldtrue", MAT_FT_MAT5);
  if (file == nullptr) return false;
  const LatticeArrays arrays = LatticeArrays::of(field);
  std::vector<std::size_t> shape;
  for (const int count : field.points.counts) shape.push_back(static_cast<std::size_t>(count));
  const auto shapeOf = [&shape](std::size_t n) {
    std::vector<std::size_t> with = shape;
    with.push_back(n);
    return with;
  };
  bool good = true;
  for (std::size_t axis = 0; axis < 3; ++axis)
    good = good && addArray(file, (std::string(1, "xyz"[axis]) + "_m").c_str(), {arrays.axes_m[axis].size(), 1},
                            arrays.axes_m[axis]);
  good = good && addArray(file, "raw_m", shapeOf(3), byComponent(field, 3, [&](std::size_t at, std::size_t component) {
                            return field.points.point_m(at)[static_cast<Eigen::Index>(component)];
                          }));
  good = good &&
         addArray(file, "corrected_m", shapeOf(3), byComponent(field, 3, [&](std::size_t at, std::size_t component) {
                    const auto c = static_cast<Eigen::Index>(component);
                    return field.points.point_m(at)[c] + field.displacement_m[at][c];
                  }));
  good = good && addArray(file, "q_wxyz", shapeOf(4), byComponent(field, 4, [&](std::size_t at, std::size_t component) {
                            const Eigen::Quaterniond& q = field.rotation[at];
                            return std::array{q.w(), q.x(), q.y(), q.z()}[component];
                          }));
  good = good && addArray(file, "uncertainty_m", shape, field.uncertainty_m);
  good = good && addArray(file, "inside", shape, {field.inside.begin(), field.inside.end()});
  good = good && addText(file, "about", factLines(facts, ""));
  return Mat_Close(file) == 0 && good;
}

Result<void> writeMat(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  Facts all = facts;
  all.emplace_back("use", "F = griddedInterpolant({x_m, y_m, z_m}, corrected_m(:,:,:,1))");
  return replaceFileAtomically(path, [&](const std::filesystem::path& beside) -> Result<void> {
    if (!fillMat(beside, field, all))
      return fail(ErrorCode::kIo,
                  "Cannot write " + path.string() + ": the arrays could not be stored; is the disk full?");
    return {};
  });
}

/// Walks over the elements of a file of version 5: what is missing or damaged matio takes for zeros.
/// @error kBadInput with the reason alone
/// @source MathWorks, MAT-File Format, "Level 5 MAT-File Format"
Result<void> checkElements(std::string_view bytes) {
  constexpr std::size_t kHead = 128, kTag = 8;
  constexpr std::uint32_t kCompressed = 15;
  if (bytes.size() < kHead) return fail(ErrorCode::kBadInput, "the file is cut off");
  const bool is_big_endian = bytes.substr(kHead - 2, 2) == "MI";
  const auto numberAt = [&](std::size_t at) {
    const auto number = static_cast<std::uint32_t>(int32At(bytes, at));
    return is_big_endian ? __builtin_bswap32(number) : number;
  };
  for (std::size_t at = kHead; at < bytes.size();) {
    const std::size_t left = bytes.size() - at;
    if (left < kTag || numberAt(at + 4) > left - kTag) return fail(ErrorCode::kBadInput, "the file is cut off");
    const std::size_t n = numberAt(at + 4);
    // Unpacked to the end, where its check sum is.
    if (numberAt(at) == kCompressed) FT_TRY_VOID(inflated(bytes.substr(at + kTag, n)).map([](const std::string&) {}));
    at += kTag + n;
  }
  return {};
}

bool holds(mat_t* file, const char* name) {
  matvar_t* variable = Mat_VarReadInfo(file, name);
  const bool is_there = variable != nullptr;
  Mat_VarFree(variable);
  return is_there;
}

std::vector<double> numbersOf(mat_t* file, const char* name) {
  matvar_t* variable = Mat_VarRead(file, name);
  if (variable == nullptr) return {};
  std::vector<double> numbers;
  if (variable->class_type == MAT_C_DOUBLE && variable->data != nullptr) {
    const auto* data = static_cast<const double*>(variable->data);
    numbers.assign(data, data + variable->nbytes / sizeof(double));
  } else if (variable->class_type == MAT_C_UINT8 && variable->data != nullptr) {  // Truth values among them.
    const auto* data = static_cast<const std::uint8_t*>(variable->data);
    numbers.assign(data, data + variable->nbytes);
  }
  Mat_VarFree(variable);
  return numbers;
}

Result<LatticeField> readMat(const std::filesystem::path& path) {
  const auto isNot = [&](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no lattice that can be read: " + why);
  };
  FT_TRY(const std::string bytes, readFile(path));
  const std::unique_ptr<mat_t, int (*)(mat_t*)> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY), Mat_Close);
  // Version 4 has no arrays of more than two dimensions; version 7.3 is HDF5, which misses its own end.
  if (!file || Mat_GetVersion(file.get()) == MAT_FT_MAT4) return isNot("it is no MAT-file of version 5 or later");
  if (Mat_GetVersion(file.get()) == MAT_FT_MAT5)
    if (const auto whole = checkElements(bytes); !whole) return isNot(whole.error().message);
  LatticeArrays arrays;
  for (std::size_t axis = 0; axis < 3; ++axis)
    arrays.axes_m[axis] = numbersOf(file.get(), (std::string(1, "xyz"[axis]) + "_m").c_str());
  const std::vector<double> corrected = numbersOf(file.get(), "corrected_m"), turned = numbersOf(file.get(), "q_wxyz"),
                            inside = numbersOf(file.get(), "inside");
  const std::size_t nx = arrays.axes_m[0].size(), ny = arrays.axes_m[1].size(), nz = arrays.axes_m[2].size();
  const std::size_t n = nx * ny * nz;
  if (n == 0 || corrected.size() != 3 * n)
    return isNot("it holds no x_m, y_m, z_m and corrected_m that belong together");
  if (inside.size() != n && holds(file.get(), "inside"))
    return isNot("its array inside holds no number for each point");
  for (std::size_t i = 0; i < nx; ++i)
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t k = 0; k < nz; ++k) {
        const std::size_t at = i + nx * (j + ny * k);
        arrays.corrected_m.emplace_back(corrected[at], corrected[n + at], corrected[2 * n + at]);
        if (turned.size() == 4 * n)
          arrays.q.emplace_back(turned[at], turned[n + at], turned[2 * n + at], turned[3 * n + at]);
        if (inside.size() == n) arrays.inside.push_back(inside[at] != 0.0 ? 1 : 0);
      }
  auto field = arrays.lattice();
  if (!field) return isNot(field.error().message);
  return field;
}

Result<Written> exportMat(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl& control) {
  LatticeForm form = arraysForm(96.0);
  form.write = writeMat;
  form.read = readMat;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace matlab

Exporter matlabExporter() {
  using namespace matlab;
  return {.id = "matlab",
          .label = "Lattice (MATLAB)",
          .extension = ".mat",
          .reads_it = "MATLAB (griddedInterpolant), GNU Octave, SciPy",
          .in_words = "metres; where measured positions (tracker frame) truly are (the calibration's frame)",
          .purpose = Purpose::kNumbers,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportMat,
          .read = readMat};
}

}  // namespace fieldtrue::exporters
