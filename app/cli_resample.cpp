#include <algorithm>
#include <string>

#include "app/cli.h"
#include "app/cli_text.h"
#include "app/cli_values.h"
#include "calib/calibration/alignment.h"
#include "calib/calibration/resampled_table.h"
#include "calib/evaluation/base/noise_floor.h"
#include "calib/tables/table_writer.h"

/// resample: brings the errors of scattered places to a grid in tracked space.
namespace fieldtrue::cli {
namespace {

struct ResampleOptions {
  std::string nodes;
  std::string method;
  std::string plan;
  std::string out;
  std::string align;
  double width_pitches = 1.0;
  TableArguments table;
};

/// The grid of a plan, one place a node.
Read<std::vector<PlannedPlace>> readGrid(const acquisition::Plan& plan) {
  if (!plan.explicit_places.empty())
    return wrongUsage("resample needs the plan of a grid in tracked space, got a plan that lists single places");
  if (plan.orientations > 1 || plan.reseat > 1)
    return wrongUsage("a resampled table has one row a grid node: leave orientations and reseat out of the plan");
  return places(plan);
}

Answer answerOf(const ResampleOptions& options, const calibration::ResampledTable& resampled,
                const evaluation::NoiseFloor& floor) {
  const std::size_t n_grid = resampled.table.nodes.size();
  const std::size_t n_supported = n_grid - resampled.n_without_support;
  const correctors::RegridError& error = resampled.error;
  Answer answer;
  answer.json = {{"schema", "fieldtrue.resample/1"},
                 {"software", std::string("Fieldtrue ") + FIELDTRUE_VERSION},
                 {"file", options.out},
                 {"method", options.method},
                 {"nodes", n_grid},
                 {"without_support", resampled.n_without_support},
                 {"held_out",
                  {{"rms_mm", error.n_scored > 0 ? nlohmann::json(error.rms_mm) : nlohmann::json(nullptr)},
                   {"places", error.n_scored},
                   {"without_support", error.n_without_support}}},
                 {"floor_mm", floor.from == "not stated" ? nlohmann::json(nullptr) : nlohmann::json(floor.position_mm)},
                 {"floor_from", floor.from}};
  answer.text = std::to_string(n_supported) + " of " + std::to_string(n_grid) + " grid nodes resampled by " +
                options.method + ", written to " + options.out + "\n";
  answer.text +=
      "Error of the resampling, each place predicted from the others: " +
      (error.n_scored > 0 ? millimetres(error.rms_mm) + " RMS over " + std::to_string(error.n_scored) + " places (" +
                                std::to_string(error.n_without_support) + " at the edge cannot be predicted)"
                          : std::string("cannot be told, no place lies between the others")) +
      "\nNoise floor of the table: " +
      (floor.from == "not stated" ? "not stated" : millimetres(floor.position_mm) + " (" + floor.from + ")") + "\n";
  if (resampled.n_without_support > 0)
    answer.remarks.push_back(std::to_string(resampled.n_without_support) + " of " + std::to_string(n_grid) +
                             " grid nodes lie outside the measured places; they are written with role skipped, nothing "
                             "is extrapolated");
  return answer;
}

Outcome runResample(const ResampleOptions& options, const CommonOptions& common) {
  const auto method = correctors::findRegridMethod(options.method);
  if (!method) return wrongUsage(method.error());
  const auto plan = readPlanArgument(options.plan);
  if (!plan) return tl::unexpected(plan.error());
  const auto grid = readGrid(*plan);
  if (!grid) return tl::unexpected(grid.error());
  const auto reading = readRowsArgument(options.nodes, options.table, SensorRows::kOne);
  if (!reading) return tl::unexpected(reading.error());
  const auto align = readAlignArgument(options.align, calibration::defaultAlignMode(reading->table.metadata));
  if (!align) return tl::unexpected(align.error());
  // The longest pitch, so that the kernel reaches the neighbours along every axis.
  const correctors::RegridOptions how{*method, plan->pitch_m.maxCoeff(), options.width_pitches};
  const auto resampled =
      calibration::resampleTable(reading->table, *grid, how, *align, runControl(common, "resampling"));
  if (!resampled) return notPossible(resampled.error());
  const auto written = writeNodeTable(std::filesystem::path(options.out), resampled->table);
  if (!written) return notPossible(written.error());
  std::vector<Node> used;
  std::copy_if(reading->table.nodes.begin(), reading->table.nodes.end(), std::back_inserter(used),
               [](const Node& node) { return node.role == NodeRole::kFit; });
  Answer answer = answerOf(options, *resampled, evaluation::noiseFloor(used, reading->table.metadata));
  answer.remarks.insert(answer.remarks.begin(), reading->notes.begin(), reading->notes.end());
  if (!resampled->note.empty()) answer.remarks.push_back(resampled->note);
  if (const std::size_t n_unused = reading->table.nodes.size() - used.size(); n_unused > 0)
    answer.remarks.push_back(std::to_string(n_unused) + " rows of role validation or skipped were not used");
  return answer;
}

}  // namespace

void addResampleCommand(CommandLine& line) {
  auto [command, options] =
      line.add("resample", "Bring the errors of scattered places to a grid in tracked space", runResample);
  command->add_option("--nodes", options->nodes, "Node table; rows of role fit are used")
      ->type_name("FILE")
      ->required();
  command
      ->add_option(
          "--method", options->method,
          "briggs (smallest surrounding tetrahedron), livingston (Gaussian kernel cut off at three pitches) or "
          "czernuszenko (inverse squared distance to all places)")
      ->type_name("METHOD")
      ->required();
  command
      ->add_option("--plan", options->plan,
                   "grid:NXxNYxNZ@PX[xPYxPZ][:origin=x,y,z] in metres: a grid in tracked space, not in the rig's frame")
      ->type_name("PLAN")
      ->required();
  command
      ->add_option("--width-pitches", options->width_pitches,
                   "SD of livingston's kernel in pitches of the grid; not published, one pitch is our choice")
      ->type_name("W")
      ->check(numberWithin(0.05, 20.0));
  command
      ->add_option("--align", options->align,
                   "none or rigid; default rigid unless the table says the alignment is known")
      ->type_name("MODE");
  addTableOptions(*command, options->table);
  command->add_option("--nodes-out", options->out, "Node table to write")->type_name("FILE")->required();
}

}  // namespace fieldtrue::cli
