#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// A Gaussian process with an anisotropic Matern kernel about a linear trend, each place with its own noise, scales by
/// restricted likelihood.
PositionMethod gaussianProcessPosition();

}  // namespace fieldtrue
