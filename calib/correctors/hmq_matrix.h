#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `hmq_matrix`.
OrientationMethod hmqMatrixOrientation();

}  // namespace fieldtrue
