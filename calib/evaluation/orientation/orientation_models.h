#pragma once

#include <cstdint>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/evaluation/orientation/orientation_rows.h"

namespace fieldtrue::evaluation {

/// Errors of the held-out rows, by place, of a model without and with terms in the orientation.
struct NestedErrors {
  std::vector<double> place_only_deg;
  std::vector<double> with_orientation_deg;
};

/// Within each place the mean error is free (any function of the place); the larger model adds functions of the true
/// orientation up to degree 2, held back by a ridge that is chosen inside the training rows and may be infinite.
/// @param hold_out_orientations leaves out whole orientations too: rows are scored by fits that saw neither their place
///        nor their orientation
NestedErrors nestedModelErrors(const OrientationRows& rows, bool hold_out_orientations, std::uint64_t seed,
                               const RunControl& control);

}  // namespace fieldtrue::evaluation
