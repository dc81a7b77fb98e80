#pragma once

#include <vector>

#include "calib/gap/held_out.h"
#include "calib/gap/report.h"
#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// The candidates of a report: every effect tried in place of the leading one, and none, with probabilities, intervals
/// and what cannot be told apart on this grid. Best first.
/// @param mm_per_unit turns whitened amplitudes into position [mm]
std::vector<GapCandidate> describeCandidates(const identify::GapSearch& search,
                                             const identify::EffectSelection& selection, const HeldOutGap& held_out,
                                             double mm_per_unit);

/// The selected effects in the order they were added.
/// @param candidates of the same selection
std::vector<SelectedEffect> describeSelected(const identify::GapSearch& search,
                                             const identify::EffectSelection& selection, const HeldOutGap& held_out,
                                             const std::vector<GapCandidate>& candidates, double mm_per_unit);

}  // namespace fieldtrue::gap
