#include "calib/core/file_io.h"
#include "calib/exporters/itk_field.h"
#include "calib/exporters/itk_parameters.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {
namespace itk_tfm {
namespace {

constexpr const char* kHead = "#Insight Transform File V1.0\n";

Result<void> writeTfm(const LatticeField& field, const Facts& facts, const std::filesystem::path& path) {
  const ItkParameters itk = ItkParameters::of(ItkField::of(field));
  return writeFileAtomically(path, [&](std::ostream& out) {
    out << kHead << factLines(itkFacts(facts)) << "#Transform 0\nTransform: " << ItkParameters::kType
        << "\nParameters:";
    for (const double number : itk.parameters) out << ' ' << formatNumber(number);
    out << "\nFixedParameters:";
    for (const double number : itk.fixed) out << ' ' << formatNumber(number);
    out << '\n';
  });
}

Result<LatticeField> readTfm(const std::filesystem::path& path) {
  const auto isNot = [&](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no displacement field that can be read: " + why);
  };
  FT_TRY(const auto content, readFile(path));
  if (!content.starts_with("#Insight Transform File")) return isNot("it does not begin as an ITK transform file");
  const auto after = [&content](const std::string& key) {
    const std::size_t at = content.find("\n" + key + ":");
    if (at == std::string::npos) return std::string();
    const std::size_t from = at + key.size() + 2;
    return content.substr(from, content.find('\n', from) - from);
  };
  if (after("Transform").find(ItkParameters::kType) == std::string::npos)
    return isNot("its transform is '" + after("Transform") + "', not " + ItkParameters::kType);
  const auto parameters = numbersIn(after("Parameters")), fixed = numbersIn(after("FixedParameters"));
  if (!parameters) return isNot(parameters.error().message);
  if (!fixed) return isNot(fixed.error().message);
  const auto itk = ItkParameters{*fixed, *parameters}.field();
  if (!itk) return isNot(itk.error().message);
  auto field = itk->lattice();
  if (!field) return isNot(field.error().message);
  return field;
}

Result<Written> exportTfm(const ExportSubject& subject, const ExportOptions& options, const std::filesystem::path& path,
                          const RunControl& control) {
  LatticeForm form = itkForm(66.0);  // Three numbers of up to 22 letters.
  form.write = writeTfm;
  form.read = readTfm;
  return writeLattice(subject, options, path, form, control);
}

}  // namespace
}  // namespace itk_tfm

Exporter itkTfmExporter() {
  using namespace itk_tfm;
  return {.id = "itk_tfm",
          .label = "ITK transform, text",
          .extension = ".tfm",
          .reads_it = "ITK, SimpleITK, 3D Slicer",
          .in_words = kItkWords,
          .purpose = Purpose::kSlicer,
          .may_be_inverse = true,
          .has_free_pitch = true,
          .write = exportTfm,
          .read = readTfm};
}

}  // namespace fieldtrue::exporters
