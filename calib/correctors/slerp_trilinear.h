#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `slerp_trilinear`.
OrientationMethod slerpTrilinearOrientation();

}  // namespace fieldtrue
