#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "app/cli.h"
#include "app/cli_values.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/judged_calibration.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"

/// export: a calibration for another program.
namespace fieldtrue::cli {
namespace {

struct ExportArguments {
  std::string calibration;
  std::string format;
  std::string direction;
  std::string orientation;
  std::optional<int> sensor;
  std::optional<double> bake_um;
  std::optional<double> max_deviation_um;
  double max_size_mib = 256.0;
  bool force = false;
  std::string out;
};

constexpr double kMiB = 1024.0 * 1024.0;

Read<exporters::Direction> readDirection(const std::string& text) {
  for (const auto direction : {exporters::Direction::kMeasuredToTrue, exporters::Direction::kTrueToMeasured})
    if (text.empty() || text == exporters::directionText(direction)) return direction;
  return wrongUsage("--direction '" + text + "' is neither measured-to-true nor true-to-measured");
}

/// `mean` or `qw,qx,qy,qz`.
Read<void> readOrientation(const std::string& text, exporters::ExportOptions& options) {
  options.mean_orientation = text == "mean";
  if (text.empty() || options.mean_orientation) return {};
  std::array<double, 4> q{};
  char end = '\0';
  const int n = std::sscanf(text.c_str(), "%lf,%lf,%lf,%lf%c", &q[0], &q[1], &q[2], &q[3], &end);
  const Eigen::Quaterniond read(q[0], q[1], q[2], q[3]);
  if (n != 4 || !(std::abs(read.norm() - 1.0) < 0.01))
    return wrongUsage("--orientation '" + text + "' is neither mean nor a quaternion qw,qx,qy,qz of length 1");
  options.orientation = read.normalized();
  return {};
}

/// The calibration's file without folder and endings.
std::string plainName(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  for (const char* ending : {".json", ".ftcal"})
    if (name.ends_with(ending)) name.resize(name.size() - std::string(ending).size());
  return name;
}

std::string contentOf(const exporters::Exporter& exporter, const exporters::ExportOptions& options) {
  if (options.direction == exporters::Direction::kMeasuredToTrue) return exporter.in_words;
  return "true to measured, the inverse of: " + exporter.in_words;
}

Outcome runExport(const ExportArguments& arguments, const CommonOptions& common) {
  const auto exporter = exporters::findExporter(arguments.format);
  if (!exporter) return wrongUsage(exporter.error());
  exporters::ExportOptions options;
  const auto direction = readDirection(arguments.direction);
  if (!direction) return tl::unexpected(direction.error());
  options.direction = *direction;
  if (const auto read = readOrientation(arguments.orientation, options); !read) return tl::unexpected(read.error());
  options.name = plainName(arguments.calibration);
  if (arguments.max_deviation_um) options.max_deviation_m = 1e-6 * *arguments.max_deviation_um;
  options.max_size_bytes = kMiB * arguments.max_size_mib;

  const std::filesystem::path path = exporters::exportPath(**exporter, arguments.out, options);
  std::error_code ignored;
  if (std::filesystem::equivalent(path, arguments.calibration, ignored))
    return notPossible(path.string() + " is the calibration that is read; choose another name");
  if (!arguments.force &&
      (std::filesystem::is_regular_file(path, ignored) || std::filesystem::is_directory(path, ignored)))
    return notPossible(path.string() + " exists already and was left as it is; choose another name, or add --force");

  auto corrector = calibration::Corrector::load(arguments.calibration);
  if (corrector && arguments.sensor) corrector = corrector->ofSensor(*arguments.sensor);
  if (corrector && arguments.bake_um)
    corrector = corrector->baked(1e-6 * *arguments.bake_um, runControl(common, "baking"));
  if (!corrector) return notPossible(corrector.error());
  if ((*exporter)->tells_error)
    if (const auto judged = evaluation::heldOutRms(*corrector, runControl(common, "leaving places out")))
      options.held_out = exporters::HeldOutError{judged->rms_mm / 1000.0, judged->validated};
  const auto written =
      exporters::exportCalibration(**exporter, *corrector, options, path, runControl(common, "sampling"));
  if (!written) return notPossible(written.error());

  Answer answer;
  answer.json = {{"file", path.string()},
                 {"format", (*exporter)->id},
                 {"direction", exporters::directionText(options.direction)},
                 {"content", contentOf(**exporter, options)},
                 {"notes", written->notes},
                 {"deviation", nullptr},
                 {"held_out_rms_mm", nullptr}};
  if (written->deviation)
    answer.json["deviation"] = {{"worst_um", 1e6 * written->deviation->worst_m},
                                {"p99_um", 1e6 * written->deviation->p99_m},
                                {"points", written->deviation->n_points}};
  if (options.held_out) answer.json["held_out_rms_mm"] = 1000.0 * options.held_out->rms_m;
  answer.text = (*exporter)->label + " written to " + path.string() + "\n";
  answer.text += "  " + contentOf(**exporter, options) + "\n";
  for (const std::string& note : written->notes) answer.text.append("  ").append(note).append("\n");
  return answer;
}

}  // namespace

void addExportCommand(CommandLine& line) {
  auto [command, arguments] = line.add("export", "Write a calibration for another program", runExport);
  command->add_option("--calibration", arguments->calibration, "Calibration (*.ftcal.json)")
      ->type_name("FILE")
      ->required();
  command->add_option("--format", arguments->format, "Format; see fieldtrue-cli formats")->type_name("ID")->required();
  command->add_option("--out", arguments->out, "File to write, or a folder, which gets NAME_measured-to-true.EXT")
      ->type_name("PATH")
      ->required();
  command
      ->add_option("--direction", arguments->direction,
                   "measured-to-true (default), or true-to-measured for programs that resample")
      ->type_name("WAY");
  command
      ->add_option(
          "--max-deviation-um", arguments->max_deviation_um,
          "How far a lattice may be off inside the region (default 50); formats of fixed form are refused where "
          "they are farther off than this, if it is given")
      ->type_name("UM")
      ->check(numberWithin(0.01, 1e6));
  command->add_option("--max-size-mib", arguments->max_size_mib, "Largest lattice in the file (default 256)")
      ->type_name("MIB")
      ->check(numberWithin(0.01, 1e5));
  command
      ->add_option("--orientation", arguments->orientation,
                   "Where the correction depends on how the sensor is turned: mean, or the orientation that counts")
      ->type_name("qw,qx,qy,qz");
  command
      ->add_option("--sensor", arguments->sensor,
                   "The sensor whose correction is written, where each has its own; its mounting, where they share one")
      ->type_name("N");
  command
      ->add_option("--bake-um", arguments->bake_um,
                   "Bake the position part to a lattice first, which deviates by at most so much inside the region")
      ->type_name("UM")
      ->check(numberWithin(0.01, 1e6));
  addForceOption(*command, arguments->force, "Write over a file that is there");
}

}  // namespace fieldtrue::cli
