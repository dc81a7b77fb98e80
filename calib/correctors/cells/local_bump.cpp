#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/cells/tracked_grid.h"

namespace fieldtrue::correctors {
namespace {

Result<std::unique_ptr<PositionModel>> fitLocalBump(const FitData& data, const Settings& settings, const RunControl&) {
  return fitLocalPosition(data, weightRule(WeightKind::kBrysonBump, settings), "Bryson's bump interpolation");
}

}  // namespace

PositionMethod localBumpPosition() {
  return {.id = "local_bump",
          .label = "Local, bump (Bryson)",
          .source = "Bryson 1992; survey by Kindratenko, section 3.3, eq. 8-10",
          .settings = {lengthUnitSetting(), bumpEndSetting()},
          .fit = fitLocalBump,
          .read = readLocalPosition,
          .tuning = Tuning::kNever,  // The end of the bump is the cell's own length.
          .origin = MethodOrigin::kSurvey,
          .tries = {{"", simplicity::kInterpolating}},
          .reading = trackedGridReading()};
}

}  // namespace fieldtrue::correctors
