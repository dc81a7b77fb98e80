#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "acquisition/session/imported_session.h"
#include "acquisition/session/session_store.h"
#include "app/cli.h"
#include "app/cli_values.h"
#include "calib/exporters/imported_calibration.h"
#include "calib/importers/column_guess.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "calib/importers/text_table.h"
#include "calib/recording/unit_slip.h"
#include "calib/simulation/simulator.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"

/// simulate, tables, import: commands that make files from other files.
namespace fieldtrue::cli {
namespace {

struct TableCounts {
  std::size_t places = 0;
  std::size_t rows = 0;
  std::size_t samples = 0;
};

TableCounts count(const CalibrationTable& table) {
  std::set<int> places;
  TableCounts counts;
  for (const Node& node : table.nodes) {
    places.insert(node.node);
    counts.samples += static_cast<std::size_t>(node.n_used + node.n_rejected);
  }
  counts.places = places.size();
  counts.rows = table.nodes.size();
  return counts;
}

/// Where tables go; an empty path is not written.
struct TablePaths {
  std::string nodes;
  std::string samples;
};

/// Writes what there is and tells so.
Outcome writeTables(const TablePaths& paths, const CalibrationTable* table, const SampleTable* samples,
                    const std::vector<std::string>& notes) {
  Answer answer;
  answer.json["notes"] = notes;
  for (const std::string& note : notes) answer.text += note + "\n";
  if (!paths.samples.empty() && samples != nullptr) {
    const auto written = writeSampleTable(std::filesystem::path(paths.samples), *samples);
    if (!written) return notPossible(written.error());
    answer.json["samples"] = {{"file", paths.samples}, {"rows", samples->rows.size()}};
    answer.text += std::to_string(samples->rows.size()) + " samples written to " + paths.samples + "\n";
  }
  if (!paths.nodes.empty() && table != nullptr) {
    const auto written = writeNodeTable(std::filesystem::path(paths.nodes), *table);
    if (!written) return notPossible(written.error());
    const TableCounts counts = count(*table);
    answer.json["nodes"] = {{"file", paths.nodes}, {"places", counts.places}, {"rows", counts.rows}};
    answer.text += std::to_string(counts.places) + " places (" + std::to_string(counts.rows) + " rows, " +
                   std::to_string(counts.samples) + " samples) written to " + paths.nodes + "\n";
  }
  return answer;
}

struct SimulateOptions {
  std::string scene;
  std::string plan;
  std::uint64_t seed = 1;
  int samples_per_node = 60;
  bool exact = false;
  TablePaths out;
};

Outcome runSimulate(const SimulateOptions& options, const CommonOptions& common) {
  const auto plan = readPlanArgument(options.plan);
  if (!plan) return tl::unexpected(plan.error());
  const auto scene = readSceneArgument(options.scene);
  if (!scene) return tl::unexpected(scene.error());
  simulation::SimulationOptions simulation_options;
  simulation_options.seed = options.seed;
  simulation_options.samples_per_node = options.samples_per_node;
  if (options.exact) {
    const auto table =
        simulation::simulateExactly(*scene, places(*plan), simulation_options, runControl(common, "simulating"));
    if (!table) return notPossible(table.error());
    return writeTables(options.out, &*table, nullptr, {});
  }
  const auto simulation =
      simulation::simulate(*scene, places(*plan), simulation_options, runControl(common, "simulating"));
  if (!simulation) return notPossible(simulation.error());
  return writeTables(options.out, &simulation->table, &simulation->samples, {});
}

void addSimulate(CommandLine& line) {
  auto [command, options] = line.add("simulate", "Record a plan in a simulated room", runSimulate);
  command->add_option("--scene", options->scene, "Scene file (*.scene.json); default a clean room")->type_name("FILE");
  command
      ->add_option("--plan", options->plan,
                   "grid:NXxNYxNZ@PX[xPYxPZ][:origin=x,y,z][:order=serpentine|random][:seed=n][:orientations=k]"
                   "[:reseat=m] in metres, or a *.plan.json")
      ->type_name("PLAN")
      ->required();
  addSeedOption(*command, options->seed, "Seed of noise and placing (default 1)");
  command->add_option("--samples-per-node", options->samples_per_node, "Samples at each place (default 60)")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
  auto* exact =
      command->add_flag("--exact", options->exact, "Noise-free poses, the jig exactly where its drawing says");
  command->add_option("--nodes", options->out.nodes, "Node table to write")->type_name("FILE")->required();
  auto* samples = command->add_option("--samples", options->out.samples, "Sample table to write")->type_name("FILE");
  exact->excludes(samples);
}

struct TablesOptions {
  std::string session;
  TablePaths out;
};

Outcome runTables(const TablesOptions& options, const CommonOptions&) {
  const auto session = acquisition::SessionStore::open(QString::fromStdString(options.session));
  if (!session) return notPossible(session.error());
  const auto table = session->nodeTable();
  if (!table) return notPossible(table.error());
  if (table->nodes.empty()) {
    return notPossible(options.session + " holds no recorded place yet; record at least one with acquire");
  }
  Outcome written;
  if (options.out.samples.empty()) {
    written = writeTables(options.out, &*table, nullptr, {});
  } else {
    const auto samples = session->sampleTable();
    if (!samples) return notPossible(samples.error());
    written = writeTables(options.out, &*table, &*samples, {});
  }
  if (written) written->remarks = session->remarks();
  return written;
}

void addTables(CommandLine& line) {
  auto [command, options] = line.add("tables", "Write a session's node and sample tables", runTables);
  command->add_option("--session", options->session, "Session file (*.fieldtrue)")->type_name("FILE")->required();
  command->add_option("--nodes", options->out.nodes, "Node table to write")->type_name("FILE")->required();
  command->add_option("--samples", options->out.samples, "Sample table to write")->type_name("FILE");
}

struct ImportOptions {
  std::string format;
  std::string in;
  std::string truth;
  TablePaths out;
  std::string session;
  std::string calibration;
  bool guess = false;
};

constexpr std::size_t kRowsShown = 5;

std::string readingCommand(const std::string& format, const std::string& in, const std::string& outputs) {
  return "fieldtrue-cli import --format " + format + " --in '" + in + "'" + outputs + "\n";
}

/// The options that say where a recording goes: into a table beside it, of its places where their true positions are
/// known.
std::string recordingOutputs(const importers::Importer& importer, const Settings& settings, const std::string& in) {
  if (importer.needs_truth) return " --truth TRUE_POSITIONS --nodes '" + in + ".nodes.csv'";
  const auto imported = importer.read(in, {}, settings);
  const bool has_samples_only = imported && !imported->table;
  return has_samples_only ? " --samples '" + in + ".samples.csv'" : " --nodes '" + in + ".nodes.csv'";
}

/// The command that reads a file which is of a known format.
Answer knownFormat(const std::string& id, const std::string& label, const std::string& in, const std::string& outputs) {
  Answer answer;
  answer.json = {{"format", id}};
  answer.text = label + "\n" + readingCommand(id, in, outputs);
  return answer;
}

/// Whether the values can stand in a format's text and between a shell's quotes.
bool isTypeable(const Settings& settings) {
  return std::all_of(settings.begin(), settings.end(), [](const auto& setting) {
    const std::string* text = std::get_if<std::string>(&setting.second);
    return text == nullptr || text->find_first_of(",='\"\\") == std::string::npos;
  });
}

/// What a file seems to hold, and the command that reads it so. Nothing is written.
Outcome runGuess(const ImportOptions& options) {
  if (const importers::Importer* importer = importers::recogniseRecording(options.in))
    return knownFormat(importer->id, importer->label, options.in,
                       recordingOutputs(*importer, importers::usualSettings(*importer), options.in));
  if (const exporters::CalibrationFormat* format = exporters::recogniseCalibration(options.in))
    return knownFormat(format->id, format->label, options.in, " --calibration '" + options.in + ".ftcal.json'");
  const auto guess = importers::guessColumns(options.in);
  if (!guess) return notPossible(guess.error());
  const auto preview = importers::previewText(options.in, guess->settings, kRowsShown);
  if (!preview) return notPossible(preview.error());
  std::string format = importers::formatText(guess->settings);
  if (!guess->has_unit) format += format.find(':') == std::string::npos ? ":unit=?" : ",unit=?";
  Answer answer;
  answer.json = {{"format", format},
                 {"settings", toJson(guess->settings)},
                 {"reasons", guess->reasons},
                 {"has_unit", guess->has_unit},
                 {"columns", preview->columns},
                 {"rows", preview->rows}};
  for (const std::string& reason : guess->reasons) answer.text.append(reason).append("\n");
  const auto show = [&](const std::vector<std::string>& fields) {
    for (const std::string& field : fields) answer.text.append("  ").append(field);
    answer.text += "\n";
  };
  show(preview->columns);
  for (const std::vector<std::string>& row : preview->rows) show(row);
  if (isTypeable(guess->settings))
    answer.text += readingCommand("'" + format + "'", options.in,
                                  recordingOutputs(**importers::findImporter("columns"), guess->settings, options.in));
  else
    answer.text +=
        "a column that is used has , = or a quote in its name, which --format cannot take: rename it, or import "
        "the file in the window\n";
  return answer;
}

Outcome runImportCalibration(const exporters::CalibrationFormat& format, const ImportOptions& options) {
  if (options.calibration.empty())
    return wrongUsage("format " + format.id + " holds a calibration; name the file to write with --calibration");
  if (!options.out.nodes.empty() || !options.out.samples.empty() || !options.session.empty() || !options.truth.empty())
    return wrongUsage("format " + format.id +
                      " holds a calibration and no table; leave --nodes, --samples, --session and --truth out");
  const auto imported = exporters::importCalibration(format, options.in);
  if (!imported) return notPossible(imported.error());
  const auto saved = imported->save(options.calibration);
  if (!saved) return notPossible(saved.error());
  Answer answer;
  answer.json["notes"] = imported->report().notes;
  for (const std::string& note : imported->report().notes) answer.text += note + "\n";
  answer.json["calibration"] = {{"file", options.calibration}};
  answer.text += "calibration written to " + options.calibration + "\n";
  return answer;
}

/// The chosen importer and its settings, or what is wrong with `--format`.
Read<std::pair<const importers::Importer*, Settings>> readFormat(const std::string& text) {
  const auto format = parseMethodText(text);
  if (!format) return wrongUsage(format.error());
  const auto importer = importers::findImporter(format->id);
  if (!importer) {
    std::string calibrations;
    for (const exporters::CalibrationFormat& known : exporters::calibrationFormats()) {
      if (!calibrations.empty()) calibrations += ", ";
      calibrations += known.id;
    }
    return wrongUsage(importer.error().message + "; and of calibrations: " + calibrations);
  }
  auto settings = resolveSettings(format->id, (*importer)->settings, format->given);
  if (!settings) return wrongUsage(settings.error());
  return std::pair{*importer, std::move(*settings)};
}

Outcome runImport(const ImportOptions& options, const CommonOptions&) {
  if (options.guess) return runGuess(options);
  if (options.format.empty()) return wrongUsage("--format is required, or --guess to be told which");
  if (const exporters::CalibrationFormat* format = exporters::findCalibrationFormat(options.format))
    return runImportCalibration(*format, options);
  const auto format = readFormat(options.format);
  if (!format) return tl::unexpected(format.error());
  const auto& [importer, settings] = *format;
  if (importer->needs_truth && options.truth.empty()) {
    return wrongUsage("format " + importer->id + " holds no true positions; name the file that does with --truth");
  }
  if (!options.calibration.empty())
    return wrongUsage("format " + importer->id +
                      " holds measurements; fit a calibration to them with fieldtrue-cli fit");
  if (options.out.nodes.empty() && options.out.samples.empty() && options.session.empty()) {
    return wrongUsage("nothing to write; name a file with --nodes, --samples or --session");
  }
  std::optional<std::filesystem::path> truth;
  if (!options.truth.empty()) truth = options.truth;
  auto imported = importer->read(options.in, truth, settings);
  if (!imported) return notPossible(imported.error());
  if (imported->table) {
    if (const auto units = recording::checkUnits(*imported->table); !units)
      imported->notes.push_back(units.error().message);
  }
  const bool needs_table = !options.out.nodes.empty() || !options.session.empty();
  if (needs_table && !imported->table) {
    return notPossible(options.in + " holds no true positions, so there is no node table" +
                       (options.session.empty() ? "" : " and no session") + "; write its samples with --samples");
  }
  if (!options.out.samples.empty() && !imported->samples) {
    return notPossible(options.in + " holds means only, so there is no sample table; leave --samples out");
  }
  if (!options.session.empty()) {
    const auto made = acquisition::makeSession(QString::fromStdString(options.session), *imported->table,
                                               imported->samples, options.in + " by " + options.format);
    if (!made) return notPossible(made.error());
  }
  Outcome written = writeTables(options.out, imported->table ? &*imported->table : nullptr,
                                imported->samples ? &*imported->samples : nullptr, imported->notes);
  if (written && !options.session.empty()) {
    written->json["session"] = {{"file", options.session}};
    written->text += "session written to " + options.session + "; open it with fieldtrue\n";
  }
  return written;
}

void addImport(CommandLine& line) {
  auto [command, options] = line.add("import", "Read another program's files", runImport);
  command
      ->add_option("--format", options->format,
                   "Format, with settings as in columns:key=value,...; see fieldtrue-cli formats")
      ->type_name("ID");
  command->add_flag(
      "--guess", options->guess,
      "Guess the format, and of a table of text columns and unit, and show the first rows; write nothing");
  command->add_option("--in", options->in, "File to read")->type_name("FILE")->required();
  command->add_option("--truth", options->truth, "File with the true positions, where the format needs one")
      ->type_name("FILE");
  command->add_option("--nodes", options->out.nodes, "Node table to write")->type_name("FILE");
  command->add_option("--samples", options->out.samples, "Sample table to write")->type_name("FILE");
  command->add_option("--session", options->session, "Session to make, to be opened in the window")->type_name("FILE");
  command->add_option("--calibration", options->calibration, "Calibration to write, where the format holds one")
      ->type_name("FILE");
}

}  // namespace

void addDataCommands(CommandLine& line) {
  addSimulate(line);
  addTables(line);
  addImport(line);
}

}  // namespace fieldtrue::cli
