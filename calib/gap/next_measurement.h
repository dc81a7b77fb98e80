#pragma once

#include "calib/gap/report.h"
#include "calib/identify/selection.h"

namespace fieldtrue::gap {

/// What to measure or to do next, in one sentence an operator can follow, and what removing the culprit would change.
/// Where the leading effects are not settled: of places beyond each face of the grid, the same places with the sensor
/// turned, and a second round in time, those where the two best models differ most, measured in noise (the expected
/// log-likelihood ratio, Kullback and Leibler 1951). Fills the report's parts of that name.
void suggestNext(const identify::GapSearch& search, const identify::EffectSelection& selection, GapReport& report);

}  // namespace fieldtrue::gap
