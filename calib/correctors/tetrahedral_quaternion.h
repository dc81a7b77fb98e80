#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `tetrahedral_quaternion`.
OrientationMethod tetrahedralQuaternionOrientation();

}  // namespace fieldtrue
