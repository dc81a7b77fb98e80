#include <algorithm>
#include <string>

#include "app/cli.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/calibration_difference.h"
#include "widgets/report/difference_text.h"

/// difference: what changed between two calibrations of one set-up.
namespace fieldtrue::cli {
namespace {

struct DifferenceOptions {
  std::string first;
  std::string second;
};

constexpr std::size_t kLabelWidth = 30;

std::string describe(const evaluation::CalibrationDifference& difference) {
  std::string text;
  for (const auto& [label, told] : widgets::differenceFacts(difference))
    text.append(label).append(kLabelWidth - std::min(kLabelWidth, label.size()), ' ').append(told).append("\n");
  return text + difference.text + "\n";
}

Outcome runDifference(const DifferenceOptions& options, const CommonOptions& common) {
  const auto first = calibration::Corrector::load(options.first);
  if (!first) return notPossible(first.error());
  const auto second = calibration::Corrector::load(options.second);
  if (!second) return notPossible(second.error());
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
}

}  // namespace fieldtrue::cli
