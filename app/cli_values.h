#pragma once

#include <string>
#include <vector>

#include "acquisition/session/plan.h"
#include "app/cli.h"
#include "calib/core/calibration_table.h"
#include "calib/core/settings.h"
#include "calib/core/table_io.h"
#include "calib/correctors/corrector.h"
#include "calib/evaluation/comparison.h"
#include "calib/simulation/scene.h"

/// Reading of what people write on the command line and in the files they name, with the right exit status.
namespace fieldtrue::cli {

/// A value that commands read, or why they end.
template <class T>
using Read = tl::expected<T, Failure>;

/// A plan text (`grid:...`) or file.
Read<Plan> readPlanArgument(const std::string& text_or_path);

/// The scene of a file; the clean room with the default tracker when the path is empty.
Read<Scene> readSceneArgument(const std::string& path);

/// A node table, and what its reader noticed.
Read<TableReading<CalibrationTable>> readNodesArgument(const std::string& path);

/// `none` or `rigid`; `fallback` when empty.
Read<AlignMode> readAlignArgument(const std::string& text, AlignMode fallback);
std::string toText(AlignMode align);

/// What `--methods`, `--validate`, `--align` and `--seed` say about a comparison.
struct ComparisonArguments {
  std::string methods = "all";
  std::string validate;
  std::string align;
  std::uint64_t seed = 1;
};
void addComparisonOptions(CLI::App& command, ComparisonArguments& arguments);
Read<ComparisonOptions> readComparisonArguments(const ComparisonArguments& arguments);

/// Splits `a,b:key=1,other=2,c` into method texts; a part with '=' and no ':' continues the method before it.
std::vector<std::string> splitMethods(const std::string& text);

}  // namespace fieldtrue::cli
