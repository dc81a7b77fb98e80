#pragma once

#include "calib/gap/report.h"
#include "calib/identify/linearized_model.h"
#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// Which effects a design can tell apart: for each pair the share of one's signal, after the alignment, that the other
/// can imitate (the lesser of both directions), and advice. No measured value enters.
/// @param starts_each how many places of an effect's coarse grid are looked at
Isolability isolabilityOf(const identify::GapSearch& search, std::size_t starts_each, const RunControl& control);

/// The smallest size of each effect that would have been found on this design.
std::vector<SmallestDetectable> smallestDetectable(const identify::GapSearch& search);

}  // namespace fieldtrue::gap
