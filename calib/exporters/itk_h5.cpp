#include <hdf5.h>

#include <map>

#include "calib/core/file_io.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/itk_parameters.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace itk_h5 {
namespace {

/// A handle of HDF5, closed at the end of its scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  hid_t id() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Datasets without a time of creation, so that the same calibration gives the same bytes.
class Timeless {
 public:
  Timeless() : list_(H5Pcreate(H5P_DATASET_CREATE), H5Pclose) { H5Pset_obj_track_times(list_.id(), false); }
  hid_t id() const { return list_.id(); }

 private:
  Handle list_;
};

/// HDF5 prints its errors unless told otherwise.
void beQuiet() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

bool addText(hid_t where, const char* name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  const hsize_t one = 1;
  const Handle space(H5Screate_simple(1, &one, nullptr), H5Sclose);
  const Timeless timeless;
  const Handle set(H5Dcreate2(where, name, type.id(), space.id(), H5P_DEFAULT, timeless.id(), H5P_DEFAULT), H5Dclose);
  const char* value = text.c_str();
  return set.valid() && H5Dwrite(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0;
}

bool addNumbers(hid_t where, const char* name, const std::vector<double>& numbers) {
  const hsize_t size = numbers.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Timeless timeless;
  const Handle set(H5Dcreate2(where, name, H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, timeless.id(), H5P_DEFAULT),
                   H5Dclose);
  return set.valid() && H5Dwrite(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) >= 0;
}

bool fillFile(const std::filesystem::path& path, const ItkParameters& itk, const Facts& facts) {
  const Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  if (!file.valid()) return false;
  const auto group = [&file](const char* name) {
    return hid_t{H5Gcreate2(file.id(), name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)};
  };
  bool good = addText(file.id(), "ITKVersion", "5.2.1") && addText(file.id(), "HDFVersion", H5_VERS_INFO) &&
              addText(file.id(), "OSName", "any") && addText(file.id(), "OSVersion", "any");
  const Handle transforms(group("/TransformGroup"), H5Gclose), first(group("/TransformGroup/0"), H5Gclose);
  good = good && transforms.valid() && first.valid() && addText(first.id(), "TransformType", ItkParameters::kType) &&
         addNumbers(first.id(), "TransformFixedParameters", itk.fixed) &&
         addNumbers(first.id(), "TransformParameters", itk.parameters);
  const Handle about(group("/Fieldtrue"), H5Gclose);
  good = good && about.valid();
  for (const auto& [key, value] : facts) good = good && addText(about.id(), key.c_str(), value);
  return good && H5Fflush(file.id(), H5F_SCOPE_LOCAL) >= 0;
}

Result<void> writeH5(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  beQuiet();
  return replaceFileAtomically(path, [&](const std::filesystem::path& beside) -> Result<void> {
    if (!fillFile(beside, ItkParameters::of(ItkField::of(field)), itkFacts(facts)))
      return fail(ErrorCode::kIo,
                  "Cannot write " + path.string() + ": HDF5 could not store the lattice; is the disk full?");
    return {};
  });
}

std::optional<std::vector<double>> numbersOf(hid_t file, const char* name) {
  const Handle set(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  if (!set.valid()) return std::nullopt;
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  const hssize_t size = H5Sget_simple_extent_npoints(space.id());
  if (size < 0) return std::nullopt;
  std::vector<double> numbers(static_cast<std::size_t>(size));
  if (H5Dread(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) < 0) return std::nullopt;
  return numbers;
}

Result<LatticeField> readH5(const std::filesystem::path& path) {
  beQuiet();
  const auto isNot = [&](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no displacement field that can be read: " + why);
  };
  FT_TRY_VOID(openForReading(path).map([](const std::ifstream&) {}));
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.valid()) return isNot("it is no HDF5 file");
  const auto fixed = numbersOf(file.id(), "/TransformGroup/0/TransformFixedParameters");
  const auto parameters = numbersOf(file.id(), "/TransformGroup/0/TransformParameters");
  if (!fixed || !parameters) return isNot("it holds no transform with parameters");
  const auto itk = ItkParameters{*fixed, *parameters}.field();
  if (!itk) return isNot(itk.error().message);
  auto field = itk->lattice();
  if (!field) return isNot(field.error().message);
  return field;
}

Result<Written> exportH5(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                         const RunControl& control) {
  LatticeForm form = itkForm(24.0);
  form.write = writeH5;
  form.read = readH5;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace itk_h5

Exporter itkH5Exporter() {
  using namespace itk_h5;
  return {.id = "itk_h5",
          .label = "ITK transform, HDF5",
          .extension = ".h5",
          .reads_it = "ITK, SimpleITK, 3D Slicer, ANTs",
          .in_words = kItkWords,
          .purpose = Purpose::kSlicer,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportH5,
          .read = readH5};
}

}  // namespace fieldtrue::exporters
