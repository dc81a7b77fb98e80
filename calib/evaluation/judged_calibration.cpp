#include "calib/evaluation/judged_calibration.h"

#include "calib/correctors/base/method_text.h"
#include "calib/correctors/registry.h"

namespace fieldtrue::evaluation {

Result<Comparison> judgeCalibration(const calibration::Corrector& corrector, const RunControl& control) {
  const calibration::CorrectorChoice& choice = corrector.choice();
  FT_TRY(const MethodText method,
         parseMethodText(correctors::methodText(choice.position_id, choice.position_settings)));
  ComparisonOptions options;
  options.position_methods = {method};
  options.orientation_methods = {{"none", {}}};
  options.align = corrector.align();
  options.separate_sensors = choice.separate_position;
  options.with_surroundings = false;
  return compareMethods(corrector.table(), options, control);
}

const MethodScore* scoreOf(const Comparison& judged, const calibration::Corrector& corrector) {
  for (const MethodScore& score : judged.position)
    if (score.method == corrector.choice().position_id && !score.skipped) return &score;
  return nullptr;
}

std::optional<HeldOutRms> heldOutRms(const calibration::Corrector& corrector, const RunControl& control) {
  const auto method = correctors::findPositionMethod(corrector.choice().position_id);
  if (!method || (*method)->cost == correctors::FitCost::kVeryCostly) return std::nullopt;
  const auto judged = judgeCalibration(corrector, control);
  const MethodScore* score = judged ? scoreOf(*judged, corrector) : nullptr;
  if (score == nullptr) return std::nullopt;
  return HeldOutRms{score->stats.rms, toText(judged->validation)};
}

}  // namespace fieldtrue::evaluation
