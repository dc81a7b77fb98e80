#pragma once

#include <vector>

#include "calib/gap/gap_report.h"
#include "widgets/views/believed_body.h"

namespace fieldtrue {

/// The selected effects that have a place in the room, in the rig's frame.
std::vector<BelievedBody> believedBodies(const GapReport& report);

}  // namespace fieldtrue
