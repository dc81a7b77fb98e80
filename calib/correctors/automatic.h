#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// Chooses method and settings by cross-validation on the data it is fitted to.
PositionMethod automaticPosition();

}  // namespace fieldtrue
