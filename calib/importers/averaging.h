#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/statistics.h"

namespace fieldtrue::importers {

/// Sets the status of a sample whose position is the mark of a missing reading.
void markMissing(Sample& sample);

struct AveragedNodes {
  std::vector<Node> nodes;         ///< One for each (node, sensor, visit), ordered by them; no truth yet.
  std::vector<std::string> notes;  ///< One sentence a node: counts, what was rejected and why, autocorrelation.
};

/// Averages the samples of each (node, sensor, visit); rows between places (node -1) are left out.
/// @param place_word what the source calls a place, for the notes: "landmark"
/// @error kTooFewNodes naming the place when none of its samples is good
Result<AveragedNodes> averageRows(std::span<const SampleRow> rows, const AveragingOptions& options,
                                  bool has_orientation, const std::string& place_word);

}  // namespace fieldtrue::importers
