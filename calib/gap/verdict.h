#pragma once

#include <string>

#include "calib/gap/judgement.h"
#include "calib/gap/report.h"

namespace fieldtrue::gap {

/// How much of the gap's square scatters from place to place beyond the floor, 0 to 1: a tolerance that is a little too
/// small is no gap, and neither is what a person with a jig does where none is stated.
/// @param stated the rows as the table and the scene state them
double scatteredShare(const identify::GapSearch& search, const identify::GapRows& stated, const GapReport& report);

/// Whether anything stands out of the floor: smooth, or scattered.
bool hasGap(const identify::GapSearch& search, const Judgement& judgement, double scattered_share);

/// Unexplained where nothing is named or surely too much of the excess is left on places that no fit saw; partly
/// explained where surely less of it is.
GapVerdict verdictOf(const HowFar& far, bool has_effect, bool has_gap, const identify::Thresholds& thresholds);

/// Verdict and candidates of what was judged, where the gap lies, and how large gap and floor are.
/// @param known_gap whether there is a gap, where that is known already
/// @return whether there is one
bool decide(const identify::GapSearch& search, const Judgement& judgement, std::optional<bool> known_gap,
            GapReport& report);

/// A figure as the sentences of a diagnosis show it.
std::string shown(double value);

/// Why effects that fit are not named, a clause; "" where nothing was refused.
std::string whyRefused(const Judgement& judgement);

/// One sentence: what was found, how sure, what to do.
/// @param thing what it is that is or is not explained
std::string verdictText(const GapReport& report, const std::string& thing = "gap");

}  // namespace fieldtrue::gap
