#include "calib/core/declare.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/cells/tracked_grid.h"

namespace fieldtrue::correctors {
namespace {

Result<std::unique_ptr<PositionModel>> fitLocalBriggs(const FitData& data, const Settings& settings,
                                                      const RunControl&) {
  const WeightKind kind = boolSetting(settings, "as_published") ? WeightKind::kBriggsAsPublished : WeightKind::kBriggs;
  FT_TRY(auto grid, trackedGrid(data, settings, "Briggs's local interpolation"));
  std::string note = joinedNotes({grid.note, kind == WeightKind::kBriggs
                                                 ? std::string()
                                                 : "Weights as published: they add up to 64 and more instead of 1."});
  return makeLocalPosition(std::move(grid.cells), std::move(grid.v_m), weightRule(kind, settings), std::move(note));
}

std::vector<Setting> briggsSettings() {
  std::vector<Setting> settings = resampleSettings();
  settings.push_back(declare::flag(
      "as_published", "Weights as published", false,
      "Uses the published normalisation, which is wrong, to show what it does; the weights then do not add up to 1."));
  return settings;
}

}  // namespace

PositionMethod localBriggsPosition() {
  return {.id = "local_briggs",
          .label = "Local, inverse squares (Briggs)",
          .source = "Briggs 1999; survey by Kindratenko, section 3.3, eq. 12-13",
          .settings = briggsSettings(),
          .fit = fitLocalBriggs,
          .read = readLocalPosition,
          .origin = MethodOrigin::kSurvey,
          .tries = {{"", simplicity::kInterpolating}},
          .reading = trackedGridReading()};
}

}  // namespace fieldtrue::correctors
