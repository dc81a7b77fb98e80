#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `polynomial_euler`.
OrientationMethod polynomialEulerOrientation();

}  // namespace fieldtrue
