#pragma once

#include <span>
#include <string>

#include "calib/core/calibration_table.h"

namespace fieldtrue::evaluation {

/// The error that is left when the tracker's mean error is corrected perfectly: noise of the means and tolerance of the
/// jig.
struct NoiseFloor {
  /// RMS over places of sqrt(trace(cov)/n_eff + 3 tolerance^2); 0 = the table states neither.
  double position_mm = 0.0;
  /// RMS over places of sqrt(sd_rot^2/n_eff + 3 tolerance^2); 0 = the table states neither.
  double orientation_deg = 0.0;
  std::string from;  ///< What entered: "samples and jig tolerance", "samples", "jig tolerance", "not stated".
};

/// @param nodes the scored rows
NoiseFloor noiseFloor(std::span<const Node> nodes, const TableMetadata& metadata);

}  // namespace fieldtrue::evaluation
