#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `local_linear`.
PositionMethod localLinearPosition();

}  // namespace fieldtrue
