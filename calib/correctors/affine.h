#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `affine`.
PositionMethod affinePosition();

}  // namespace fieldtrue
