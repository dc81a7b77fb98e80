#include <unistd.h>

#include <QCoreApplication>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "app/cli.h"
#include "app/cli_barrier.h"
#include "app/cli_gap_text.h"
#include "app/cli_pictures.h"
#include "app/cli_signals.h"
#include "app/cli_values.h"
#include "calib/core/file_io.h"
#include "calib/gap/diagnosis.h"
#include "calib/gap/first_look.h"
#include "calib/gap/plan_check.h"
#include "calib/gap/report_json.h"
#include "calib/tables/table_sensors.h"
#include "widgets/report/gap_section.h"

/// diagnose, plan-check, blind: the gap between the simulation and what was recorded.
namespace fieldtrue::cli {
namespace {

constexpr const char* kBlindProgram = "fieldtrue-blind";

struct DiagnoseOptions {
  std::string nodes;
  std::string against;
  std::string samples;
  std::string scene;
  std::string out;
  std::string html;
  std::string updated_scene;
  int replicates = 0;
  bool first = false;
  TableArguments table;
};

/// All that a diagnosis starts from.
struct DiagnosisInput {
  CalibrationTable table;
  std::shared_ptr<const CalibrationTable> against;
  std::optional<SampleTable> samples;
  std::optional<simulation::Scene> scene;
  std::vector<std::string> notes;
};

Read<DiagnosisInput> readDiagnosisInput(const DiagnoseOptions& options) {
  DiagnosisInput input;
  auto nodes = readRowsArgument(options.nodes, options.table, SensorRows::kAll);
  if (!nodes) return tl::unexpected(nodes.error());
  input.table = std::move(nodes->table);
  input.notes = std::move(nodes->notes);
  if (!options.against.empty()) {
    if (!options.samples.empty()) return wrongUsage("--samples tells nothing of what changed --against; leave one out");
    auto before = readRowsArgument(options.against, options.table, SensorRows::kAll);
    if (!before) return tl::unexpected(before.error());
    input.against = std::make_shared<CalibrationTable>(std::move(before->table));
  }
  if (!options.samples.empty()) {
    auto samples = readSampleTable(std::filesystem::path(options.samples));
    if (!samples) return notPossible(samples.error());
    input.samples =
        options.table.sensor ? rowsOfSensor(samples->table, *options.table.sensor) : std::move(samples->table);
    input.notes.insert(input.notes.end(), samples->notes.begin(), samples->notes.end());
  }
  if (!options.scene.empty()) {
    auto scene = readSceneArgument(options.scene);
    if (!scene) return tl::unexpected(scene.error());
    input.scene = *std::move(scene);
  }
  return input;
}

/// Works beside the event loop, so that SIGINT and SIGTERM end the work in order.
template <class T, class Work>
Result<T> stoppable(RunControl control, Work work) {
  std::stop_source source;
  control.stop = source.get_token();
  std::optional<Result<T>> result;
  const EndRequest end_request([&source] { source.request_stop(); });
  std::thread worker([&] {
    result = commandBarrier([&] { return work(control); });
    QMetaObject::invokeMethod(QCoreApplication::instance(), &QCoreApplication::quit, Qt::QueuedConnection);
  });
  QCoreApplication::exec();
  worker.join();
  return *std::move(result);
}

Result<void> writeScene(const std::string& path, const simulation::Scene& scene) {
  return writeFileAtomically(path, [&](std::ostream& out) { out << toJson(scene).dump(2) << '\n'; });
}

/// On standard error, before the diagnosis of all places begins.
void tellFirstLook(const CalibrationTable& table, const simulation::Scene* scene, const RunControl& control) {
  const auto part = gap::firstLook(table);
  if (!part) return;
  RunControl quiet = control;
  quiet.progress = [](double) {};
  if (const auto report = gap::diagnose(*part, nullptr, scene, {}, quiet))
    std::cerr << "Provisional, by " << report->input.places << " of the places: " << report->text << std::endl;
}

Outcome runDiagnose(const DiagnoseOptions& options, const CommonOptions& common) {
  const auto input = readDiagnosisInput(options);
  if (!input) return tl::unexpected(input.error());
  const SampleTable* samples = input->samples ? &*input->samples : nullptr;
  const simulation::Scene* scene = input->scene ? &*input->scene : nullptr;
  const auto report = stoppable<gap::GapReport>(runControl(common, "diagnosing"), [&](const RunControl& control) {
    gap::DiagnosisOptions diagnosis;
    diagnosis.replicates = options.replicates;
    diagnosis.against = input->against;
    if (options.first) tellFirstLook(input->table, scene, control);
    return gap::diagnose(input->table, samples, scene, diagnosis, control);
  });
  if (!report) return notPossible(report.error());
  if (const auto written = gap::writeGapReport(options.out, *report); !written) return notPossible(written.error());
  Answer answer{gapText(*report) + "\nWritten to " + options.out + "\n", toJson(*report), input->notes};
  if (!options.html.empty()) {
    if (const auto written = widgets::writeGapHtml(*report, drawByProgram, options.html, &input->table); !written)
      return notPossible(written.error());
    answer.text += "Page written to " + options.html + "\n";
  }
  if (!options.updated_scene.empty()) {
    const simulation::Scene updated =
        gap::updatedScene(input->scene.value_or(simulation::Scene{}), input->table.metadata, *report);
    if (const auto written = writeScene(options.updated_scene, updated); !written) return notPossible(written.error());
    answer.text +=
        "Scene with " + std::to_string(updated.effects.size()) + " effects written to " + options.updated_scene + "\n";
  }
  return answer;
}

void addDiagnose(CommandLine& line) {
  auto [command, options] = line.add(
      "diagnose", "Find where a recording differs from the simulation, why, and by how much less", runDiagnose);
  command->add_option("--nodes", options->nodes, "Node table")->type_name("FILE")->required();
  addTableOptions(*command, options->table);
  command
      ->add_option(
          "--against", options->against,
          "Node table recorded before, of these or other places: find what changed since, whatever the rig says")
      ->type_name("FILE");
  command->add_option("--samples", options->samples, "Its sample table: mains, filter and lattice show only there")
      ->type_name("FILE");
  command
      ->add_option("--scene", options->scene,
                   "What the simulator believes (*.scene.json); default an ideal tracker in free space")
      ->type_name("FILE");
  command
      ->add_option("--replicates", options->replicates,
                   "Make the recording so many times again under what is found, diagnose each, and tell how often the "
                   "same is named (0, the default: not; 50 is a good number, at most ten minutes)")
      ->type_name("N")
      ->check(CLI::Range(0, 1000));
  command
      ->add_flag("--first", options->first,
                 "Tell on standard error within seconds what some of the places say, where there are 180 and more")
      ->excludes("--against");
  command->add_option("--out", options->out, "Report to write (*.gap.json)")->type_name("FILE")->required();
  command->add_option("--html", options->html, "Page to write beside it")->type_name("FILE");
  command
      ->add_option("--updated-scene", options->updated_scene, "Scene to write with the effects that were found added")
      ->type_name("FILE");
}

struct PlanCheckOptions {
  std::string plan;
  std::string nodes;
  std::string scene;
  TableArguments table;
};

std::vector<PlannedPlace> placesOf(const CalibrationTable& table) {
  std::vector<PlannedPlace> places;
  for (const Node& node : table.nodes) {
    places.push_back({node.node, node.visit, node.index, node.reference_from_sensor, node.role});
  }
  return places;
}

Read<std::vector<PlannedPlace>> readPlaces(const PlanCheckOptions& options) {
  if (options.plan.empty() == options.nodes.empty()) {
    return wrongUsage("name the grid to check: --plan PLAN or --nodes FILE, one of the two");
  }
  if (!options.plan.empty()) {
    const auto plan = readPlanArgument(options.plan);
    if (!plan) return tl::unexpected(plan.error());
    return places(*plan);
  }
  const auto reading = readRowsArgument(options.nodes, options.table, SensorRows::kOne);
  if (!reading) return tl::unexpected(reading.error());
  return placesOf(reading->table);
}

Outcome runPlanCheck(const PlanCheckOptions& options, const CommonOptions& common) {
  const auto places = readPlaces(options);
  if (!places) return tl::unexpected(places.error());
  std::optional<simulation::Scene> scene;
  if (!options.scene.empty()) {
    auto read = readSceneArgument(options.scene);
    if (!read) return tl::unexpected(read.error());
    scene = *std::move(read);
  }
  const auto check = stoppable<gap::PlanCheck>(runControl(common, "checking"), [&](const RunControl& control) {
    return gap::planCheck(*places, scene ? &*scene : nullptr, control);
  });
  if (!check) return notPossible(check.error());
  Answer answer;
  answer.json = toJson(check->isolability);
  answer.json["orientations"] = toJson(check->orientations);
  answer.json["schema"] = "fieldtrue.plan-check/1";
  answer.json["rows"] = places->size();
  answer.text = isolabilityText(check->isolability) + "\n" + check->orientations.text + "\n";
  return answer;
}

void addPlanCheck(CommandLine& line) {
  auto [command, options] =
      line.add("plan-check", "Tell which effects a planned grid cannot tell apart, before recording", runPlanCheck);
  command->add_option("--plan", options->plan, "Plan text (grid:...) or *.plan.json")->type_name("PLAN");
  command->add_option("--nodes", options->nodes, "Node table, instead of a plan: the grid as it was recorded")
      ->type_name("FILE");
  addTableOptions(*command, options->table);
  command->add_option("--scene", options->scene, "Tracker, its place and the rig's tolerances (*.scene.json)")
      ->type_name("FILE");
}

struct BlindOptions {
  const CLI::App* command = nullptr;
};

/// Beside this program, or where the build puts it.
std::filesystem::path blindProgram() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::filesystem::path built = folder.parent_path() / "tests" / "blind" / kBlindProgram;
  return access(built.c_str(), X_OK) == 0 && access((folder / kBlindProgram).c_str(), X_OK) != 0
             ? built
             : folder / kBlindProgram;
}

Outcome runBlind(const BlindOptions& options, const CommonOptions&) {
  const std::vector<std::string> given = options.command->remaining();
  const std::filesystem::path program = blindProgram();
  if (access(program.c_str(), X_OK) != 0) {
    return notPossible(std::string(kBlindProgram) + " is not beside this program, in " +
                       program.parent_path().string() + "; it is a program of its own, built with the tests");
  }
  std::vector<std::string> arguments = {program.string()};
  arguments.insert(arguments.end(), given.begin(), given.end());
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  execv(program.c_str(), pointers.data());
  return notPossible(program.string() + " cannot be started");
}

void addBlind(CommandLine& line) {
  auto [command, options] = line.add(
      "blind", "Check the diagnosis on data whose effect is withheld: generate, answer, score, controls", runBlind);
  options->command = command;
  command->prefix_command();
  command->footer("All arguments go to the separate program fieldtrue-blind; see fieldtrue-cli blind generate --help.");
}

}  // namespace

void addGapCommands(CommandLine& line) {
  addDiagnose(line);
  addPlanCheck(line);
  addBlind(line);
}

}  // namespace fieldtrue::cli
