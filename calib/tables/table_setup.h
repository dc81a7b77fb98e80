#pragma once

#include "calib/core/calibration_table.h"
#include "calib/core/setup.h"

namespace fieldtrue {

/// The set-up of a table: what it states, its date, and the sensor where all rows are of one.
Setup setupOf(const CalibrationTable& table);

}  // namespace fieldtrue
