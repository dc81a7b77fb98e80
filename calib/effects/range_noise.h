#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// More noise than the tracker's data sheet says, or noise that grows with range beyond the law.
///
/// Convention: the SD of every coupling is multiplied by factor (r / 1 m)^power. With power 0 the position noise grows
/// as r^4 and the orientation noise as r^3 from the couplings' own SD alone; a receiver that turns up its amplifier
/// with range, or a long cable, makes the couplings themselves noisier.
/// @source error propagation through nine couplings of equal SD: position r^4, orientation r^3
Effect rangeNoiseEffect();

}  // namespace fieldtrue
