#pragma once

#include <vector>

#include "calib/gap/report.h"
#include "widgets/figures/believed_body.h"

namespace fieldtrue::widgets {

/// The selected effects that have a place in the room, in the rig's frame.
std::vector<BelievedBody> believedBodies(const gap::GapReport& report);

}  // namespace fieldtrue::widgets
