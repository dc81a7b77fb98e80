#pragma once

#include "calib/gap/report.h"
#include "calib/identify/linearized_model.h"
#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// How well one effect is allowed to imitate another: at the places of its coarse grid, or, where both stand somewhere
/// in the room, fitted from the best of these.
enum class Imitators { kOfCoarseGrid, kFitted };

/// Which effects a design can tell apart: for each pair the share of one's signal, after the alignment, that the other
/// can imitate (the lesser of both directions), and advice. No measured value enters.
/// @param starts_each how many places of an effect's coarse grid are looked at
/// @param imitators fitted: `told_apart_from` is estimated too
Isolability isolabilityOf(const identify::GapSearch& search, std::size_t starts_each, Imitators imitators,
                          const RunControl& control);

/// The smallest size of each effect that would have been found on this design.
std::vector<SmallestDetectable> smallestDetectable(const identify::GapSearch& search);

}  // namespace fieldtrue::gap
