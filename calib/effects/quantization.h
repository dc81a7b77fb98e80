#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Readings reported in coarse steps: ASCII with few digits, short binary words.
///
/// Convention: each component of the position is rounded to a multiple of quantum_m, each component of the rotation
/// vector to a multiple of quantum_rad. The coarser of this and the tracker's own step holds. Where the noise is more
/// than half a step the error is uniform, SD step/sqrt(12); below, the mean of a place is biased.
/// @source Widrow and Kollar 2008, Quantization Noise
Effect quantizationEffect();

}  // namespace fieldtrue
