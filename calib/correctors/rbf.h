#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// Radial basis functions with a linear tail and noise-weighted smoothing, shape and smoothing by leave-one-out.
PositionMethod rbfPosition();

}  // namespace fieldtrue
