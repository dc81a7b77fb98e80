#pragma once

#include <cstddef>
#include <span>

#include "calib/gap/report.h"
#include "calib/identify/joint_fit.h"
#include "calib/identify/profile.h"
#include "calib/identify/thresholds.h"

namespace fieldtrue::gap {

/// What a fitted term says: its effect, place, material and figures, with 90 % intervals where its model was refined.
/// Those of things in the room are widened for the physics that their models leave out, and none reaches beyond where
/// its parameter may be searched.
/// @param intervals of the searched parameters by profile likelihood; none = by the covariance alone
void describeTerm(const identify::RefinedModel& refined, std::size_t term,
                  std::span<const identify::ProfileInterval> intervals, const identify::Thresholds& thresholds,
                  GapCandidate& candidate);

}  // namespace fieldtrue::gap
