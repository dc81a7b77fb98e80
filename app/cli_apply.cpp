#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/cli.h"
#include "app/cli_table_corrector.h"
#include "app/cli_values.h"
#include "calib/calibration/corrector.h"
#include "calib/core/file_io.h"
#include "calib/core/setup.h"
#include "calib/tables/table_sensors.h"

/// apply: corrects the poses of a table of any length, row by row.
namespace fieldtrue::cli {
namespace {

/// What rows without an orientation get; empty where nothing is to be said.
std::string remarkOnUnturned(const TableCorrector& table, const calibration::Corrector& corrector,
                             const std::string& name) {
  const RowCounts& counts = table.counts();
  if (counts.unturned == 0 || (!table.hasOrientations() && !corrector.takesOrientation())) return {};
  std::string text = table.hasOrientations() ? std::to_string(counts.unturned) + " of " + std::to_string(counts.all) +
                                                   " rows of " + name + " have no orientation"
                                             : name + " has no orientations (qw, qx, qy, qz)";
  if (!corrector.takesOrientation()) return text + ": their positions alone are corrected";
  return text + ", on which this correction depends: positions are corrected as for the mean of the " +
         std::to_string(corrector.orientationsSeen().size()) + " orientations it was fitted on";
}

struct ApplyOptions {
  std::string calibration;
  std::string in;
  std::string out;
  std::vector<std::string> setup;
  bool force = false;
};

Outcome runApply(const ApplyOptions& options, const CommonOptions&) {
  auto setup = readSetupArgument(options.setup);
  if (!setup) return tl::unexpected(setup.error());
  const auto corrector = calibration::Corrector::load(options.calibration);
  if (!corrector) return notPossible(corrector.error());
  if (std::filesystem::is_directory(options.in)) return notPossible(options.in + " is a folder, not a table");
  std::ifstream in(options.in, std::ios::binary);
  if (!in) {
    const auto reason = readFile(options.in);
    return notPossible(reason ? options.in + " cannot be opened" : reason.error().message);
  }
  TableCorrector table(*corrector, *std::move(setup), in, options.in);
  std::optional<Error> in_error;
  const auto written = writeFileAtomically(options.out, [&](std::ostream& out) {
    auto corrected = table.run(out);
    if (const auto units = table.checkUnits(); corrected && !units && !options.force) {
      corrected = fail(units.error().code, options.in + ": " + units.error().message + ", or go on with --force");
    }
    if (corrected) return;
    in_error = corrected.error();
    out.setstate(std::ios::failbit);
  });
  if (in_error) return notPossible(*in_error);
  if (!written) return notPossible(written.error());
  const RowCounts& counts = table.counts();
  Answer answer;
  answer.json = {{"file", options.out},
                 {"rows", counts.all},
                 {"outside", counts.outside},
                 {"lost", counts.lost},
                 {"other_setup", counts.other_setup},
                 {"other_sensor", counts.other_sensor}};
  answer.text = std::to_string(counts.all) + " rows written to " + options.out + "; " + std::to_string(counts.outside) +
                " outside the calibrated region (covered = 0), " + std::to_string(counts.lost) + " without a pose\n";
  answer.remarks = table.notes();
  if (const std::string remark = remarkOnUnturned(table, *corrector, options.in); !remark.empty())
    answer.remarks.push_back(remark);
  if (counts.other_sensor > 0)
    answer.remarks.push_back(std::to_string(counts.other_sensor) + " of " + std::to_string(counts.all) + " rows of " +
                             options.in + " name none of the sensors that have a correction each (" +
                             sensorsText(corrector->sensorsApart()) + "): they are corrected as sensor " +
                             std::to_string(corrector->sensorsApart().front()));
  if (counts.other_setup > 0)
    answer.remarks.push_back(std::to_string(counts.other_setup) + " of " + std::to_string(counts.all) + " rows of " +
                             options.in + " are of another set-up than the calibration (" + table.setupDifference() +
                             "): its correction is not theirs; setup_matches is no");
  if (const auto units = table.checkUnits(); !units)
    answer.remarks.push_back(options.in + ": " + units.error().message + "; used all the same");
  return answer;
}

}  // namespace

void addApplyCommand(CommandLine& line) {
  auto [command, options] = line.add("apply", "Correct the poses of a node or sample table", runApply);
  command->add_option("--calibration", options->calibration, "Calibration (*.ftcal.json)")
      ->type_name("FILE")
      ->required();
  command->add_option("--in", options->in, "Table with columns x_m, y_m, z_m and, if there, qw, qx, qy, qz")
      ->type_name("CSV")
      ->required();
  command->add_option("--out", options->out, "The same table with the corrected columns appended")
      ->type_name("CSV")
      ->required();
  addSetupOption(*command, options->setup, "What the table does not state of its set-up");
  addForceOption(*command, options->force, "Go on although the readings seem to be in another unit than metres");
}

}  // namespace fieldtrue::cli
