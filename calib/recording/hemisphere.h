#pragma once

#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::recording {

/// Whether each reading is at -p instead of p, told by the one rigid alignment that leaves the least once readings may
/// be mirrored; true errors must be less than the distance to the transmitter.
std::vector<bool> mirroredRows(const std::vector<Node>& nodes);

}  // namespace fieldtrue::recording
