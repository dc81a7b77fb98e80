#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/plan/plan.h"
#include "app/cli.h"
#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/calibration_table.h"
#include "calib/core/settings.h"
#include "calib/core/setup.h"
#include "calib/evaluation/comparison.h"
#include "calib/simulation/scene.h"
#include "calib/tables/table_io.h"

/// Reading of what people write on the command line and in the files they name, with the right exit status.
namespace fieldtrue::cli {

/// A value that commands read, or why they end.
template <class T>
using Read = tl::expected<T, Failure>;

/// Numbers from low to high; unlike CLI::Range it takes no NaN.
CLI::Validator numberWithin(double low, double high);

/// `--seed`: digits only, so that no sign is wrapped and no large number cut.
void addSeedOption(CLI::App& command, std::uint64_t& seed, const std::string& help);

/// `--device`, which must be given, and the `--scene` of a simulated one.
void addDeviceOptions(CLI::App& command, std::string& device, std::string& scene);

/// A plan text (`grid:...`) or file.
Read<acquisition::Plan> readPlanArgument(const std::string& text_or_path);

/// The scene of a file; the clean room with the default tracker when the path is empty.
Read<simulation::Scene> readSceneArgument(const std::string& path);

/// A node table, and what its reader noticed.
Read<TableReading<CalibrationTable>> readNodesArgument(const std::string& path);

/// What `--sensor` and `--force` say about a table.
struct TableArguments {
  std::optional<int> sensor;
  bool force = false;
};
void addTableOptions(CLI::App& command, TableArguments& arguments);
void addForceOption(CLI::App& command, bool& force, const std::string& help);

/// Whether a command takes the rows of all sensors at once, or those of one only.
enum class SensorRows { kAll, kOne };
/// The rows of the chosen sensor, or all, in units that can be right; what was noticed goes to the notes.
/// @param name of the table, in messages
Read<TableReading<CalibrationTable>> chooseRows(TableReading<CalibrationTable> reading, const std::string& name,
                                                const TableArguments& arguments, SensorRows sensors);
/// A node table whose rows are fitted or scored.
Read<TableReading<CalibrationTable>> readRowsArgument(const std::string& path, const TableArguments& arguments,
                                                      SensorRows sensors);

/// `none` or `rigid`; `fallback` when empty.
Read<calibration::AlignMode> readAlignArgument(const std::string& text, calibration::AlignMode fallback);
std::string toText(calibration::AlignMode align);

/// `--setup KEY=VALUE`, any number of times: facts about the set-up that files do not state.
void addSetupOption(CLI::App& command, std::vector<std::string>& given, const std::string& help);
Read<Setup> readSetupArgument(const std::vector<std::string>& given);

/// What `--methods`, `--validate`, `--align` and `--seed` say about a comparison.
struct ComparisonArguments {
  std::string methods = "all";
  std::string validate;
  std::string align;
  std::uint64_t seed = 1;
};
void addComparisonOptions(CLI::App& command, ComparisonArguments& arguments);
Read<evaluation::ComparisonOptions> readComparisonArguments(const ComparisonArguments& arguments);

/// Splits `a,b:key=1,other=2,c` into method texts; a part with '=' and no ':' continues the method before it.
std::vector<std::string> splitMethods(const std::string& text);

}  // namespace fieldtrue::cli
