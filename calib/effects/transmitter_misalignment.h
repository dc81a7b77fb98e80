#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A transmitter that does not stand where the rig says.
///
/// Convention: it is shifted by d and turned by the rotation vector w, both in the frame of the transmitter as stated.
/// Seen from the real transmitter a sensor at p then stands, to first order, at p - d - w x p and is turned by -w.
/// @source Horn 1987, J. Opt. Soc. Am. A 4 629 (rigid transform); first order by hand
Effect transmitterMisalignmentEffect();

}  // namespace fieldtrue
