#pragma once

#include "tests/support/synthetic.h"

namespace fieldtrue::testing {

/// A tracker with errors of centimetres and a tenth of a radian.
inline CalibrationTable bentTable() {
  SyntheticOptions options;
  options.reference_from_tracker = {{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
  options.smooth_distortion_m = 0.03;
  options.orientation_error_rad = 0.15;
  return syntheticTable(options, {.seed = 4, .position_sd_m = 0.001, .rotation_sd_rad = 0.002});
}

}  // namespace fieldtrue::testing
