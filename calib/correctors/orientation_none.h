#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `none`.
OrientationMethod noneOrientation();

}  // namespace fieldtrue
