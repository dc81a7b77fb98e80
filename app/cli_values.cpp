#include "app/cli_values.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <string_view>
#include <tuple>

#include "acquisition/plan/plan_text.h"
#include "calib/calibration/alignment.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/recording/unit_slip.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::cli {
namespace {

/// The text as a method of one registry, with its settings checked.
template <class Row>
Result<MethodText> readMethod(const MethodText& text, Result<const Row*> row) {
  if (!row) return tl::unexpected(row.error());
  auto settings = resolveSettings(text.id, (*row)->settings, text.given);
  if (!settings) return tl::unexpected(settings.error());
  return text;
}

template <class Rows>
void appendIds(std::string& list, const Rows& rows) {
  for (const auto& row : rows) list += (list.empty() ? "" : ", ") + row.id;
}

std::string unknownMethod(const std::string& id) {
  std::string position, orientation;
  appendIds(position, correctors::positionMethods());
  appendIds(orientation, correctors::orientationMethods());
  return "unknown method '" + id + "'; known for position: " + position + "; for orientation: " + orientation;
}

Read<void> addMethod(const std::string& text, evaluation::ComparisonOptions& options) {
  const auto parsed = parseMethodText(text);
  if (!parsed) return wrongUsage(parsed.error());
  const auto position_row = correctors::findPositionMethod(parsed->id);
  const auto orientation_row = correctors::findOrientationMethod(parsed->id);
  if (!position_row && !orientation_row) return wrongUsage(unknownMethod(parsed->id));
  const auto position = readMethod<correctors::PositionMethod>(*parsed, position_row);
  const auto orientation = readMethod<correctors::OrientationMethod>(*parsed, orientation_row);
  if (!position && !orientation) return wrongUsage(position_row ? position.error() : orientation.error());
  if (position) options.position_methods.push_back(*position);
  if (orientation) options.orientation_methods.push_back(*orientation);
  return {};
}

/// The lines of some rows of a table, which stand in its order.
std::vector<int> linesOf(const std::vector<Node>& rows, const TableReading<CalibrationTable>& reading) {
  const auto keyOf = [](const Node& node) { return std::tuple(node.node, node.sensor, node.visit); };
  std::vector<int> lines;
  std::size_t next = 0;
  for (std::size_t i = 0; i < reading.lines.size() && next < rows.size(); ++i) {
    if (keyOf(reading.table.nodes[i]) != keyOf(rows[next])) continue;
    lines.push_back(reading.lines[i]);
    ++next;
  }
  return lines;
}

}  // namespace

void addDeviceOptions(CLI::App& command, std::string& device, std::string& scene) {
  command
      .add_option("--device", device,
                  "simulated, fastrak:/dev/ttyUSB0@115200, fastrak:tcp:HOST:PORT; see fieldtrue-cli devices")
      ->type_name("DEVICE")
      ->required();
  command.add_option("--scene", scene, "Scene of the simulated tracker (*.scene.json); default a clean room")
      ->type_name("FILE");
}

CLI::Validator numberWithin(double low, double high) {
  const CLI::Range range(low, high);
  const auto check = [range](std::string& text) {
    double value = 0.0;
    const bool is_nan = CLI::detail::lexical_cast(text, value) && std::isnan(value);
    return is_nan ? "Value " + text + " is not a number" : range(text);
  };
  return CLI::Validator(check, range.get_description());
}

void addSeedOption(CLI::App& command, std::uint64_t& seed, const std::string& help) {
  const auto check = [](const std::string& text) {
    if (acquisition::parseNumber<std::uint64_t>(text)) return std::string();
    return "'" + text + "' is no seed; it must be a whole number from 0 to " +
           std::to_string(std::numeric_limits<std::uint64_t>::max()) + ", digits only";
  };
  command.add_option("--seed", seed, help)->type_name("N")->check(check);
}

Read<acquisition::Plan> readPlanArgument(const std::string& text_or_path) {
  auto plan = acquisition::readPlan(text_or_path);
  if (plan) return *plan;
  if (text_or_path.starts_with("grid:")) return wrongUsage(plan.error());
  return notPossible(plan.error());
}

Read<simulation::Scene> readSceneArgument(const std::string& path) {
  if (path.empty()) return simulation::Scene{};
  auto scene = simulation::readScene(path);
  if (!scene) return notPossible(scene.error());
  return *scene;
}

Read<TableReading<CalibrationTable>> readNodesArgument(const std::string& path) {
  auto reading = readNodeTable(std::filesystem::path(path));
  if (!reading) return notPossible(reading.error());
  return std::move(*reading);
}

void addTableOptions(CLI::App& command, TableArguments& arguments) {
  command
      .add_option("--sensor", arguments.sensor,
                  "Use the rows of this sensor only; a table may hold several, each with a mounting of its own")
      ->type_name("N");
  addForceOption(command, arguments.force, "Go on although true positions and readings seem to be in different units");
}

void addForceOption(CLI::App& command, bool& force, const std::string& help) {
  command.add_flag("--force", force, help);
}

Read<TableReading<CalibrationTable>> chooseRows(TableReading<CalibrationTable> reading, const std::string& name,
                                                const TableArguments& arguments, SensorRows sensors) {
  const std::size_t n_all = reading.table.nodes.size();
  if (arguments.sensor || sensors == SensorRows::kOne) {
    auto rows = rowsOfSensor(reading.table, arguments.sensor);
    if (!rows) return notPossible(name + ": " + rows.error().message + (arguments.sensor ? "" : ": --sensor N"));
    reading.lines = linesOf(rows->nodes, reading);
    reading.table = *std::move(rows);
  }
  if (const std::size_t n_used = reading.table.nodes.size(); n_used < n_all) {
    reading.notes.push_back(name + ": " + std::to_string(n_used) + " of " + std::to_string(n_all) +
                            " rows are of sensor " + std::to_string(*arguments.sensor));
  }
  const Result<void> units = recording::checkUnits(reading.table, reading.lines);
  if (units) return reading;
  if (!arguments.force) return notPossible(name + ": " + units.error().message + ", or go on with --force");
  reading.notes.push_back(name + ": " + units.error().message + "; used all the same");
  return reading;
}

Read<TableReading<CalibrationTable>> readRowsArgument(const std::string& path, const TableArguments& arguments,
                                                      SensorRows sensors) {
  auto reading = readNodesArgument(path);
  if (!reading) return reading;
  return chooseRows(*std::move(reading), std::filesystem::path(path).filename().string(), arguments, sensors);
}

Read<calibration::AlignMode> readAlignArgument(const std::string& text, calibration::AlignMode fallback) {
  if (text.empty()) return fallback;
  if (text == "none") return calibration::AlignMode::kNone;
  if (text == "rigid") return calibration::AlignMode::kRigid;
  return wrongUsage("--align is '" + text + "'; it must be none or rigid");
}

std::string toText(calibration::AlignMode align) { return align == calibration::AlignMode::kRigid ? "rigid" : "none"; }

void addSetupOption(CLI::App& command, std::vector<std::string>& given, const std::string& help) {
  std::string keys;
  for (const SetupFact& fact : setupFacts()) keys += (keys.empty() ? "" : ", ") + std::string(fact.key);
  command.add_option("--setup", given, help + ", e.g. room=Lab2; may be given again: " + keys)->type_name("KEY=VALUE");
}

Read<Setup> readSetupArgument(const std::vector<std::string>& given) {
  Setup setup;
  for (const std::string& text : given) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) return wrongUsage("--setup is '" + text + "'; it must be KEY=VALUE, as room=Lab2");
    const auto stated = state(setup, text.substr(0, equals), text.substr(equals + 1));
    if (!stated) return wrongUsage(stated.error());
  }
  return setup;
}

void addComparisonOptions(CLI::App& command, ComparisonArguments& arguments) {
  command
      .add_option(
          "--methods", arguments.methods,
          "all, or a list of position and orientation methods separated by commas, each with its settings after a "
          "colon: rigid,polynomial:degree=4,rbf:kernel=cubic,smoothing=0,hmq")
      ->type_name("LIST");
  command
      .add_option("--validate", arguments.validate,
                  "role, loo, kfold:K or block:8; default role where validation rows exist, else kfold:10, or loo "
                  "where no method is tuned or costly")
      ->type_name("SCHEME");
  command
      .add_option("--align", arguments.align,
                  "none or rigid; default rigid unless the table says the alignment is known")
      ->type_name("MODE");
  addSeedOption(command, arguments.seed, "Seed of folds (default 1)");
}

Read<evaluation::ComparisonOptions> readComparisonArguments(const ComparisonArguments& arguments) {
  evaluation::ComparisonOptions options;
  options.seed = arguments.seed;
  if (!arguments.validate.empty()) {
    const auto validation = evaluation::parseValidation(arguments.validate);
    if (!validation) return wrongUsage(validation.error());
    options.validation = *validation;
  }
  if (!arguments.align.empty()) {
    const auto align = readAlignArgument(arguments.align, calibration::AlignMode::kRigid);
    if (!align) return tl::unexpected(align.error());
    options.align = *align;
  }
  if (arguments.methods == "all") return options;
  for (const std::string& text : splitMethods(arguments.methods)) {
    const auto added = addMethod(text, options);
    if (!added) return tl::unexpected(added.error());
  }
  // An empty list means all methods to compareMethods; whoever names only the other kind wants none of this one.
  if (options.position_methods.empty()) options.position_methods.push_back({"none", {}});
  if (options.orientation_methods.empty()) options.orientation_methods.push_back({"none", {}});
  return options;
}

std::vector<std::string> splitMethods(const std::string& text) {
  std::vector<std::string> methods;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const bool continues = part.find('=') != std::string::npos && part.find(':') == std::string::npos;
    if (continues && !methods.empty()) {
      methods.back() += "," + part;
    } else {
      methods.push_back(part);
    }
  }
  if (text.empty() || text.back() == ',') methods.emplace_back();
  return methods;
}

}  // namespace fieldtrue::cli
