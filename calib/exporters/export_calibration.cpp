#include "calib/exporters/export_calibration.h"

#include "calib/core/number_text.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::exporters {
namespace {

constexpr double kTellOrientation_m = 1e-3;

}  // namespace

std::filesystem::path exportPath(const Exporter& exporter, const std::filesystem::path& given,
                                 const ExportOptions& options) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(given, ignored)) return given;
  const std::string name = options.name.empty() ? "calibration" : options.name;
  return given / (name + "_" + directionText(options.direction) + exporter.extension);
}

Result<Written> exportCalibration(const Exporter& exporter, const calibration::Corrector& corrector,
                                  const ExportOptions& options, const std::filesystem::path& path,
                                  const RunControl& control) {
  if (options.direction == Direction::kTrueToMeasured && !exporter.may_be_inverse)
    return fail(ErrorCode::kUnsupported, "Format " + exporter.id +
                                             " is written measured-to-true only; leave --direction out, "
                                             "or choose a field of ITK or VTK or a lattice");
  if (exporter.check != nullptr) FT_TRY_VOID(exporter.check(corrector));
  if (!exporter.knows_pose && !corrector.sensorsApart().empty())
    return fail(ErrorCode::kUnsupported, "This calibration holds a correction for each of " +
                                             sensorsText(corrector.sensorsApart()) + ", and format " + exporter.id +
                                             " holds one: choose the sensor with --sensor");
  // Before minutes of sampling.
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    return fail(ErrorCode::kIo, "Cannot write " + path.string() + ": there is no folder " + folder.string());
  const ExportSubject subject(corrector, options);
  if (!exporter.knows_pose && !options.orientation && !options.mean_orientation &&
      subject.changeWithOrientation_m() > kTellOrientation_m)
    return fail(ErrorCode::kUnsupported,
                "This correction moves by up to " + shortNumber(1000.0 * subject.changeWithOrientation_m()) +
                    " mm with how the sensor is turned, and format " + exporter.id +
                    " knows positions only: choose --orientation mean, or the orientation that counts as --orientation "
                    "qw,qx,qy,qz");
  FT_TRY(auto written, exporter.write(subject, options, path, control));
  if (!exporter.knows_pose && corrector.takesOrientation())
    written.notes.push_back((options.orientation && !options.mean_orientation
                                 ? std::string("Written at one orientation")
                                 : std::string("Written as the mean over the orientations fitted")) +
                            ": over those seen the correction moves by up to " +
                            shortNumber(1000.0 * subject.changeWithOrientation_m()) + " mm.");
  return written;
}

}  // namespace fieldtrue::exporters
