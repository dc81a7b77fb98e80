#pragma once

#include <cstddef>

#include "calib/evaluation/calibration_difference.h"
#include "widgets/figures/error_field.h"

namespace fieldtrue::widgets {

/// The change from one calibration to another as arrows, thinned to about so many; the largest is always among them.
ErrorField differenceField(const evaluation::CalibrationDifference& difference, std::size_t most = 300);

}  // namespace fieldtrue::widgets
