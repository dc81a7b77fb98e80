#pragma once

#include <string>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/gap/judgement.h"
#include "calib/gap/report.h"

namespace fieldtrue::gap {

/// What each effect of the catalogue says when it is the only one, or the leading one beside the others selected, and
/// the rivals without a name; probabilities from evidence by a common temper. Best first.
/// @param has_gap whether anything stands out of the floor
/// @param scattered_share how much of the gap scatters from place to place beyond the floor
std::vector<GapCandidate> describeCandidates(const identify::GapSearch& search, const Judgement& judgement,
                                             bool has_gap, double scattered_share);

std::vector<SelectedEffect> describeSelected(const identify::GapSearch& search, const Judgement& judgement,
                                             const std::vector<GapCandidate>& candidates,
                                             const RunControl& control = {});

/// What a selected effect takes away where no fit saw it, the effects before it being there.
Shrinkage shrinkageOfStep(const HowFar& far, std::size_t effect);

/// Share of the explained sum of squares of each selected effect, averaged over the orders of adding.
/// @source Shapley 1953, Contributions to the Theory of Games II 307
std::vector<double> creditShares(const identify::GapSearch& search, const identify::EffectSelection& selection,
                                 const RunControl& control = {});

}  // namespace fieldtrue::gap
