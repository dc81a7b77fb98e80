#pragma once

#include <cstdint>

#include "calib/evaluation/orientation/orientation_models.h"

namespace fieldtrue::evaluation {

/// What the nearest other places tell about each row, near in position, or in position and orientation. The scale
/// between the two is chosen on the other half of the places.
NestedErrors neighbourErrors(const OrientationRows& rows, std::uint64_t seed);

}  // namespace fieldtrue::evaluation
