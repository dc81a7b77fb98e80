#include <array>
#include <system_error>

#include "calib/core/file_io.h"
#include "calib/exporters/rows.h"

/// The plug-in that trackd's drivers load, with its parameter file and the calibration: a folder.
namespace fieldtrue::exporters {
namespace trackd_plugin {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlugin = "libfieldtrue_trackd.so";
constexpr const char* kParameters = "fieldtrue.params";
constexpr const char* kCalibration = "calibration.ftcal.json";

/// Where the plug-in lies beside this program: as installed, or as built.
Result<fs::path> pluginPath() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path above = program.parent_path().parent_path();
  for (const fs::path& folder : {above / "lib/fieldtrue", above / "calib/runtime"})
    if (fs::exists(folder / kPlugin, error)) return folder / kPlugin;
  return fail(ErrorCode::kUnsupported, std::string(kPlugin) + " is missing; it belongs in " +
                                           (above / "lib/fieldtrue").string() + ": install Fieldtrue again");
}

std::string parametersText(const ExportSubject& subject) {
  return factLines(subject.facts("feet and degrees at the host, as below")) +
         "# What the plug-in is told. trackd: DeviceOption <device> calib " + kPlugin + " " + kParameters +
         "\n"
         "calibration=" +
         kCalibration +
         "\n"
         "# m, cm, mm, inch or feet\nunits=feet\n"
         "# deg or rad\nangles=deg\n"
         "# where each number stands in the pose\norder=x,y,z,azimuth,elevation,roll\n"
         "# the sensor whose mounting counts; -1: the first one that was calibrated\nsensor=-1\n";
}

Result<void> fill(const fs::path& folder, const ExportSubject& subject) {
  FT_TRY(const fs::path plugin, pluginPath());
  FT_TRY(const std::string bytes, readFile(plugin));
  FT_TRY_VOID(writeFileAtomically(folder / kPlugin, [&](std::ostream& out) { out << bytes; }));
  FT_TRY_VOID(subject.corrector().save(folder / kCalibration));
  return writeFileAtomically(folder / kParameters, [&](std::ostream& out) { out << parametersText(subject); });
}

tl::unexpected<Error> notWritten(const fs::path& path, const std::error_code& error) {
  return fail(ErrorCode::kIo, "Cannot write " + path.string() + ": " + error.message());
}

/// Fills a folder beside, which then takes the path's place.
Result<Written> write(const ExportSubject& subject, const ExportOptions&, const fs::path& path, const RunControl&) {
  const fs::path beside = path.string() + ".part", old = path.string() + ".old";
  std::error_code error;
  if (fs::exists(path, error) && !fs::exists(path / kParameters, error))
    return fail(ErrorCode::kIo, path.string() + " is there and is no folder of this format; choose another name");
  fs::remove_all(beside, error);
  if (!fs::create_directory(beside, error)) return notWritten(path, error);
  if (auto filled = fill(beside, subject); !filled) {
    fs::remove_all(beside, error);
    return tl::unexpected(filled.error());
  }
  if (fs::exists(path, error)) fs::rename(path, old, error);
  if (!error) fs::rename(beside, path, error);
  if (error) return notWritten(path, error);
  fs::remove_all(old, error);
  return Written{};
}

}  // namespace
}  // namespace trackd_plugin

Exporter trackdPluginExporter() {
  using namespace trackd_plugin;
  return {.id = "trackd_plugin",
          .label = "trackd plug-in",
          .extension = ".trackd",
          .reads_it = "trackd and whatever loads calibration plug-ins of its kind",
          .in_words = "a folder: the plug-in, its parameters (feet, degrees), the whole calibration",
          .purpose = Purpose::kPeriod,
          .knows_pose = true,
          .tells_error = false,
          .is_folder = true,
          .write = write};
}

}  // namespace fieldtrue::exporters
