#pragma once

#include <span>
#include <string>

#include "calib/core/calibration_table.h"

namespace fieldtrue::calibration {

/// That no orientation is used where some rows have none, as a sentence; "" where all rows have one, or none has.
std::string missingOrientationsNote(std::span<const Node> nodes);

}  // namespace fieldtrue::calibration
