#pragma once

#include <cstdint>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/evaluation/orientation/orientation_rows.h"

namespace fieldtrue::evaluation {

/// Errors of the held-out rows in the unit of the rows, by place, of a model without and with terms in the orientation.
struct NestedErrors {
  std::vector<double> place_only;
  std::vector<double> with_orientation;
};

/// Within each place the mean error is free (any function of the place); the larger model adds functions of the true
/// orientation up to degree 2, held back by a ridge that is chosen inside the training rows and may be infinite. Of
/// positions these know a lever arm and unequal or skewed coils too, whose errors grow with the range.
/// @param part that the errors of `rows` are of
/// @param hold_out_orientations leaves out whole orientations too: rows are scored by fits that saw neither their place
///        nor their orientation
NestedErrors nestedModelErrors(const OrientationRows& rows, PosePart part, bool hold_out_orientations,
                               std::uint64_t seed, const RunControl& control);

}  // namespace fieldtrue::evaluation
