#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `hexahedral_shape`.
PositionMethod hexahedralShapePosition();

}  // namespace fieldtrue
