#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `polynomial_quaternion`.
OrientationMethod polynomialQuaternionOrientation();

}  // namespace fieldtrue
