#include "calib/evaluation/judged_calibration.h"

#include "calib/correctors/base/method_text.h"

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

}  // namespace fieldtrue::evaluation
