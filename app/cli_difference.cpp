#include <algorithm>
#include <optional>
#include <string>

#include "app/cli.h"
#include "app/cli_values.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/calibration_difference.h"
#include "widgets/report/difference_text.h"

/// difference: what changed between two calibrations of one set-up.
namespace fieldtrue::cli {
namespace {

struct DifferenceOptions {
  std::string first;
  std::string second;
  std::optional<int> sensor;
};

/// A calibration, or one sensor's of it.
Read<calibration::Corrector> readCalibration(const std::string& path, std::optional<int> sensor) {
  auto corrector = calibration::Corrector::load(path);
  if (corrector && sensor) corrector = corrector->ofSensor(*sensor);
  if (!corrector) return notPossible(corrector.error());
  return *std::move(corrector);
}

constexpr std::size_t kLabelWidth = 30;

std::string describe(const evaluation::CalibrationDifference& difference) {
  std::string text;
  for (const auto& [label, told] : widgets::differenceFacts(difference))
    text.append(label).append(kLabelWidth - std::min(kLabelWidth, label.size()), ' ').append(told).append("\n");
  return text + difference.text + "\n";
}

Outcome runDifference(const DifferenceOptions& options, const CommonOptions& common) {
  const auto first = readCalibration(options.first, options.sensor);
  if (!first) return tl::unexpected(first.error());
  const auto second = readCalibration(options.second, options.sensor);
  if (!second) return tl::unexpected(second.error());
  const auto difference = evaluation::compareCalibrations(*first, *second, runControl(common, "comparing"));
  if (!difference) return notPossible(difference.error());
  Answer answer;
  answer.json = toJson(*difference);
  answer.json["first"] = options.first;
  answer.json["second"] = options.second;
  answer.text = describe(*difference);
  return answer;
}

}  // namespace

void addDifferenceCommand(CommandLine& line) {
  auto [command, options] =
      line.add("difference", "Tell what changed between two calibrations of one set-up", runDifference);
  command->add_option("first", options->first, "The earlier calibration (*.ftcal.json)")->type_name("FILE")->required();
  command->add_option("second", options->second, "The later one")->type_name("FILE")->required();
  command->add_option("--sensor", options->sensor, "The sensor that counts, where each has a correction of its own")
      ->type_name("N");
}

}  // namespace fieldtrue::cli
