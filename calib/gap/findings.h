#pragma once

#include "calib/gap/judgement.h"
#include "calib/gap/report.h"

namespace fieldtrue::gap {

/// What the input itself tells: what is assumed of the transmitter, and whether its axes are mirrored or its rows do
/// not belong together.
/// @return whether true and tracked positions are of the same places, so that causes may be looked for
bool addInputFindings(const TableMetadata& metadata, const identify::GapSearch& search, GapReport& report);

/// What was judged tells beside its causes: what is left and has no name, which places stand out, and tolerances that
/// are not what is stated.
/// @param stated the rows as the table and the scene state them
void addFindings(const identify::GapSearch& search, const identify::GapRows& stated, const Judgement& judgement,
                 bool has_gap, GapReport& report);

}  // namespace fieldtrue::gap
