#pragma once

#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/place_name.h"
#include "calib/recording/finding.h"

namespace fieldtrue::recording {

/// The rows a diagnosis may rely on, and what was found on the way to them.
struct Cleaned {
  std::vector<Node> nodes;
  std::vector<GapFinding> findings;
  PlaceNames names;  ///< Of every place of the table.
};

/// Leaves out rows that say nothing (skipped, not finite, copied, stuck), and few without an orientation where the
/// others have one; mirrors back those reported in the other hemisphere. Whatever is changed is a finding; a gap,
/// however large and sudden, is none and stays. Rows come in the order of their times or, without, of their numbers.
Cleaned cleanRows(const CalibrationTable& table);

}  // namespace fieldtrue::recording
