#include <QDateTime>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/session_store.h"
#include "app/cli.h"
#include "app/cli_pictures.h"
#include "app/cli_text.h"
#include "app/cli_values.h"
#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/units.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/learning_curve.h"
#include "calib/evaluation/sensor_splits.h"
#include "widgets/report/report.h"

/// fit, compare, report: what is done with a table of nodes.
namespace fieldtrue::cli {
namespace {

struct FitOptions {
  std::string nodes;
  std::string position;
  std::string orientation = "none";
  std::string align;
  std::string sensors = "auto";
  std::optional<double> bake_um;
  std::string out;
  std::vector<std::string> setup;
  TableArguments table;
};

/// @param sensors auto, shared or separate
Result<calibration::Corrector> fitted(const CalibrationTable& table, calibration::CorrectorChoice choice,
                                      const std::string& sensors, calibration::AlignMode align,
                                      const RunControl& control) {
  if (sensors == "auto") return evaluation::fitByEvidence(table, choice, align, control);
  FT_TRY_VOID(evaluation::checkFitRows(table));
  choice.separate_position = choice.separate_orientation = sensors == "separate";
  return calibration::Corrector::fit(evaluation::fitRowsOf(table), table.metadata, choice, align, control);
}

Answer fitAnswer(const FitOptions& options, const calibration::Corrector& corrector, calibration::AlignMode align,
                 std::size_t n_rows) {
  const std::size_t n_unused = n_rows - corrector.report().n_nodes;
  const calibration::FitReport& report = corrector.report();
  const calibration::CorrectorChoice& choice = corrector.choice();
  Answer answer;
  answer.json = {
      {"schema", "fieldtrue.fit/1"},
      {"software", std::string("Fieldtrue ") + FIELDTRUE_VERSION},
      {"file", options.out},
      {"align", toText(align)},
      {"position", {{"method", choice.position_id}, {"settings", toJson(choice.position_settings)}}},
      {"orientation", {{"method", choice.orientation_id}, {"settings", toJson(choice.orientation_settings)}}},
      {"sensors_apart", corrector.sensorsApart()},
      {"n_nodes", report.n_nodes},
      {"n_not_used", n_unused},
      {"in_sample",
       {{"rms_before_mm", report.rms_before_mm},
        {"rms_mm", kMmPerM * report.rms_m},
        {"max_mm", kMmPerM * report.max_m},
        {"orientation_rms_deg", report.orientation_rms_rad ? nlohmann::json(kDegPerRad * *report.orientation_rms_rad)
                                                           : nlohmann::json(nullptr)}}},
      {"notes", report.notes}};
  answer.text = fitText(corrector, align, n_unused) + "Written to " + options.out + "\n";
  return answer;
}

Outcome runFit(const FitOptions& options, const CommonOptions& common) {
  const auto choice = calibration::parseCorrectorChoice(options.position, options.orientation);
  if (!choice) return wrongUsage(choice.error());
  const auto setup = readSetupArgument(options.setup);
  if (!setup) return tl::unexpected(setup.error());
  auto reading = readRowsArgument(options.nodes, options.table, SensorRows::kAll);
  if (!reading) return tl::unexpected(reading.error());
  CalibrationTable& table = reading->table;
  for (const auto& [key, value] : *setup) table.metadata.setup[key] = value;
  const auto align = readAlignArgument(options.align, calibration::defaultAlignMode(table.metadata));
  if (!align) return tl::unexpected(align.error());
  auto corrector = fitted(table, *choice, options.sensors, *align, runControl(common, "fitting"));
  if (corrector && options.bake_um) corrector = corrector->baked(1e-6 * *options.bake_um, runControl(common, "baking"));
  if (!corrector) return notPossible(corrector.error());
  const auto saved = corrector->save(options.out);
  if (!saved) return notPossible(saved.error());
  Answer answer = fitAnswer(options, *corrector, *align, table.nodes.size());
  answer.remarks = reading->notes;
  return answer;
}

void addFit(CommandLine& line) {
  auto [command, options] = line.add("fit", "Fit a calibration and print its in-sample figures", runFit);
  command->add_option("--nodes", options->nodes, "Node table; rows of role fit are used")
      ->type_name("FILE")
      ->required();
  command->add_option("--position", options->position, "Position method, e.g. polynomial:degree=3")
      ->type_name("METHOD")
      ->required();
  command->add_option("--orientation", options->orientation, "Orientation method (default none)")->type_name("METHOD");
  command
      ->add_option("--align", options->align,
                   "none or rigid; default rigid unless the table says the alignment is known")
      ->type_name("MODE");
  command
      ->add_option("--sensors", options->sensors,
                   "Where the table holds several: shared, one correction; separate, one for each; auto (default), one "
                   "for each where that errs less on places left out")
      ->type_name("HOW")
      ->check(CLI::IsMember({"auto", "shared", "separate"}));
  addTableOptions(*command, options->table);
  addSetupOption(*command, options->setup, "What the table does not state of its set-up");
  command
      ->add_option("--bake-um", options->bake_um,
                   "Bake the position part to a lattice that deviates by at most so much inside the region")
      ->type_name("UM")
      ->check(numberWithin(0.01, 1e6));
  command->add_option("--out", options->out, "Calibration to write (*.ftcal.json)")->type_name("FILE")->required();
}

struct CompareOptions {
  std::string nodes;
  std::string html;
  bool learning_curve = false;
  TableArguments table;
  ComparisonArguments comparison;
};

widgets::ReportInput reportInput(CalibrationTable table, evaluation::Comparison comparison, const std::string& source,
                                 std::uint64_t seed) {
  widgets::ReportInput input;
  input.table = std::move(table);
  input.comparison = std::move(comparison);
  input.source = source;
  input.seed = seed;
  input.draw = drawByProgram;
  input.made_at = QDateTime::currentDateTime().toString(Qt::ISODate).toStdString();
  return input;
}

Outcome runCompare(const CompareOptions& options, const CommonOptions& common) {
  const auto arguments = readComparisonArguments(options.comparison);
  if (!arguments) return tl::unexpected(arguments.error());
  const auto reading = readRowsArgument(options.nodes, options.table, SensorRows::kAll);
  if (!reading) return tl::unexpected(reading.error());
  const auto comparison = evaluation::compareMethods(reading->table, *arguments, runControl(common, "comparing"));
  if (!comparison) return notPossible(comparison.error());
  std::vector<evaluation::LearningCurve> curves;
  if (options.learning_curve) {
    auto learned = evaluation::learningCurves(reading->table, *arguments, runControl(common, "learning"));
    if (!learned) return notPossible(learned.error());
    curves = *std::move(learned);
  }
  Answer answer{comparisonText(*comparison, curves), toJson(*comparison), reading->notes};
  if (options.learning_curve) {
    answer.json["learning_curves"] = nlohmann::json::array();
    for (const evaluation::LearningCurve& curve : curves) answer.json["learning_curves"].push_back(toJson(curve));
  }
  if (!options.html.empty()) {
    widgets::ReportInput input = reportInput(reading->table, *comparison, options.nodes, options.comparison.seed);
    input.notes = reading->notes;
    input.learning_curves = std::move(curves);
    const auto written = widgets::writeHtmlReport(input, options.html);
    if (!written) return notPossible(written.error());
  }
  return answer;
}

void addCompare(CommandLine& line) {
  auto [command, options] = line.add("compare", "Score the methods on places their fits did not see", runCompare);
  command->add_option("--nodes", options->nodes, "Node table")->type_name("FILE")->required();
  addTableOptions(*command, options->table);
  addComparisonOptions(*command, options->comparison);
  command->add_option("--html", options->html, "Report to write beside the answer")->type_name("FILE");
  command->add_flag("--learning-curve", options->learning_curve,
                    "Also fit growing parts of the places and tell the held-out error of each");
}

struct ReportOptions {
  std::string nodes;
  std::string session;
  std::string html;
  TableArguments table;
  ComparisonArguments comparison;
};

/// A report's input without its comparison, from a session or a node table.
Read<widgets::ReportInput> readReportInput(const ReportOptions& options) {
  widgets::ReportInput input;
  if (options.session.empty()) {
    auto reading = readRowsArgument(options.nodes, options.table, SensorRows::kAll);
    if (!reading) return tl::unexpected(reading.error());
    input.table = std::move(reading->table);
    input.notes = std::move(reading->notes);
    input.source = options.nodes;
    return input;
  }
  const auto session = acquisition::SessionStore::open(QString::fromStdString(options.session));
  if (!session) return notPossible(session.error());
  auto table = session->nodeTable();
  if (!table) return notPossible(table.error());
  auto states = session->states();
  if (!states) return notPossible(states.error());
  input.table = *std::move(table);
  input.source = options.session;
  input.places = session->places();
  input.states = *std::move(states);
  input.notes = session->remarks();
  if (session->plan().explicit_places.empty()) input.plan = toJson(session->plan()).dump();
  if (input.table.nodes.empty()) {
    return notPossible(options.session + " holds no recorded place yet; record at least four with acquire");
  }
  auto rows = chooseRows({std::move(input.table), {}}, options.session, options.table, SensorRows::kAll);
  if (!rows) return tl::unexpected(rows.error());
  input.table = std::move(rows->table);
  input.notes = std::move(rows->notes);
  return input;
}

Outcome runReport(const ReportOptions& options, const CommonOptions& common) {
  if (options.nodes.empty() == options.session.empty()) {
    return wrongUsage("name what to report on: --session FILE or --nodes FILE, one of the two");
  }
  const auto arguments = readComparisonArguments(options.comparison);
  if (!arguments) return tl::unexpected(arguments.error());
  auto input = readReportInput(options);
  if (!input) return tl::unexpected(input.error());
  const auto comparison = evaluation::compareMethods(input->table, *arguments, runControl(common, "comparing"));
  if (!comparison) return notPossible(comparison.error());
  widgets::ReportInput whole =
      reportInput(std::move(input->table), *comparison, input->source, options.comparison.seed);
  whole.plan = input->plan;
  whole.places = input->places;
  whole.states = input->states;
  whole.notes = input->notes;
  const auto written = widgets::writeHtmlReport(whole, options.html);
  if (!written) return notPossible(written.error());
  Answer answer;
  answer.json = {{"file", options.html}, {"verdict", comparison->verdict.text}};
  answer.remarks = input->notes;
  answer.text = comparison->verdict.text + "\nReport written to " + options.html + "\n";
  answer.remarks = whole.notes;
  return answer;
}

void addReport(CommandLine& line) {
  auto [command, options] = line.add("report", "Write one HTML page about a calibration", runReport);
  command->add_option("--session", options->session, "Session file (*.fieldtrue)")->type_name("FILE");
  command->add_option("--nodes", options->nodes, "Node table, instead of a session")->type_name("FILE");
  addTableOptions(*command, options->table);
  addComparisonOptions(*command, options->comparison);
  command->add_option("--html", options->html, "Page to write")->type_name("FILE")->required();
}

}  // namespace

void addFitCommands(CommandLine& line) {
  addFit(line);
  addCompare(line);
  addReport(line);
}

}  // namespace fieldtrue::cli
