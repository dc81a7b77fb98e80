#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Everything is received stronger or weaker by one factor: a wrong dipole constant, drive current or unit.
///
/// Convention: dG = g G. The range follows G ~ r^-3, so a sensor at p is reported at p (1 + g)^(-1/3) = p (1 - g/3) to
/// first order; the orientation stays. An isotropic error of the rig's scale looks the same about the transmitter.
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (inverse cube law)
Effect globalGainEffect();

}  // namespace fieldtrue
