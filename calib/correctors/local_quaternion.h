#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `local_quaternion`.
OrientationMethod localQuaternionOrientation();

}  // namespace fieldtrue
