#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// Tensor-product cubic B-splines fitted to scattered places with a bending penalty, smoothness by generalised
/// cross-validation.
PositionMethod bsplinePosition();

}  // namespace fieldtrue
