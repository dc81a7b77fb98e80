#include "calib/core/declare.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/cells/tracked_grid.h"

namespace fieldtrue::correctors {
namespace {

Result<std::unique_ptr<PositionModel>> fitLocalKindratenko(const FitData& data, const Settings& settings,
                                                           const RunControl&) {
  return fitLocalPosition(data, weightRule(weightKind(choiceSetting(settings, "weight")), settings),
                          "Kindratenko's local interpolation");
}

Setting weightSetting() {
  return declare::choice("weight", "Weights", {"linear", "quadratic", "log"}, "linear",
                         "How a corner's weight falls to 0 at half the longest diagonal of the cell.");
}

}  // namespace

PositionMethod localKindratenkoPosition() {
  return {.id = "local_kindratenko",
          .label = "Local (Kindratenko)",
          .source = "Kindratenko, Bennett 2000; survey by Kindratenko, section 3.3, eq. 8, 9 and 11",
          .settings = {weightSetting()},
          .fit = fitLocalKindratenko,
          .read = readLocalPosition,
          .origin = MethodOrigin::kSurvey,
          .tries = {{"", simplicity::kInterpolating}},
          .reading = trackedGridReading()};
}

}  // namespace fieldtrue::correctors
