#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/correctors/regrid/regrid.h"
#include "calib/correctors/regrid/regrid_error.h"

namespace fieldtrue::calibration {

/// A table brought to a grid in tracked space.
struct ResampledTable {
  CalibrationTable table;             ///< Rows in the order of the grid; those without support have role skipped.
  std::size_t n_without_support = 0;  ///< Grid nodes.
  correctors::RegridError error;      ///< What the resampling costs by itself.
  std::string note;                   ///< On places of one true position, which count as one; empty without any.
};

/// Interpolates the errors of measured places to the nodes of a grid in tracked space (survey, section 5). Each row's
/// tracked position is its grid node to the bit; its truth is what the displacement interpolated there makes of it, in
/// the table's own frame. The error rotation (tracker frame) is the weighted mean of the places'; the true orientation
/// is the one all rows share, or the identity. The covariance of a row is the samples' noise through the weights.
/// @param table its rows of role fit are used
/// @param grid places in the tracker frame; their positions, node numbers and grid indices count
/// @param align kRigid takes displacements after the rigid alignment and undoes it in what is written
/// @error as fitAlignment and checkPositions; kDegenerate when no grid node has support
Result<ResampledTable> resampleTable(const CalibrationTable& table, std::span<const PlannedPlace> grid,
                                     const correctors::RegridOptions& options, AlignMode align,
                                     const RunControl& control = {});

}  // namespace fieldtrue::calibration
