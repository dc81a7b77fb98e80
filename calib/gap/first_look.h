#pragma once

#include <cstddef>
#include <optional>

#include "calib/core/calibration_table.h"

namespace fieldtrue::gap {

/// So many places are diagnosed within seconds.
inline constexpr std::size_t kFirstLookPlaces = 60;

/// The rows of kFirstLookPlaces places spread over the table's, with every visit, sensor and orientation of them, for a
/// provisional diagnosis; unset where the table has less than three times as many, for all of it is diagnosed soon.
std::optional<CalibrationTable> firstLook(const CalibrationTable& table);

}  // namespace fieldtrue::gap
