#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the orientation method `rigid`.
OrientationMethod rigidOrientation();

}  // namespace fieldtrue
