#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `tetrahedral`.
PositionMethod tetrahedralPosition();

}  // namespace fieldtrue
