#pragma once

#include <cstddef>

#include "calib/core/run_control.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/regrid/regrid.h"

namespace fieldtrue::correctors {

/// What bringing the measured error vectors to other positions costs by itself.
struct RegridError {
  double rms_mm = 0.0;                ///< Over the places with support, of the 3-D error; 0 when there is none.
  std::size_t n_scored = 0;           ///< Places with support.
  std::size_t n_without_support = 0;  ///< Places at the edge: without them the others do not surround them.
};

/// Leaves each place out in turn and interpolates its displacement from the others. Noise of the places enters, so the
/// figure is to be read beside the noise floor; the others stand twice as far as for a node between places.
/// @param data finite (checkPositions)
RegridError regridError(const FitData& data, const RegridOptions& options, const RunControl& control = {});

}  // namespace fieldtrue::correctors
