#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `trilinear`.
PositionMethod trilinearPosition();

}  // namespace fieldtrue
