#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/cells/tracked_grid.h"

namespace fieldtrue::correctors {
namespace {

Result<std::unique_ptr<PositionModel>> fitLocalLinear(const FitData& data, const Settings& settings,
                                                      const RunControl&) {
  return fitLocalPosition(data, weightRule(WeightKind::kBrysonLinear, settings), "Bryson's linear interpolation");
}

}  // namespace

PositionMethod localLinearPosition() {
  return {.id = "local_linear",
          .label = "Local, linear (Bryson)",
          .source = "Bryson 1992; survey by Kindratenko, section 3.3, eq. 8-10",
          .settings = {},
          .fit = fitLocalLinear,
          .read = readLocalPosition,
          .origin = MethodOrigin::kSurvey,
          .tries = {{"", simplicity::kInterpolating}},
          .reading = trackedGridReading()};
}

}  // namespace fieldtrue::correctors
