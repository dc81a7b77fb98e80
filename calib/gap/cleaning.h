#pragma once

#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/gap/gap_report.h"

namespace fieldtrue {

/// The rows a diagnosis may rely on, and what was found on the way to them.
struct Cleaned {
  std::vector<Node> nodes;
  std::vector<GapFinding> findings;
};

/// Leaves out rows that say nothing (skipped, not finite, copied, stuck) and mirrors back those reported in the other
/// hemisphere. Whatever is changed is a finding; a gap, however large and sudden, is none and stays.
Cleaned cleanRows(const CalibrationTable& table);

/// Whether each reading is at -p instead of p, told by the one rigid alignment that leaves the least once readings may
/// be mirrored; true errors must be less than the distance to the transmitter.
std::vector<bool> mirroredRows(const std::vector<Node>& nodes);

/// "node 3" or "nodes 3, 5, 17 and 9 more".
std::string nodesText(std::vector<int> nodes);

}  // namespace fieldtrue
