#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A rig that leans: its pipes do not stand at right angles to its base, or its rows not to each other.
///
/// Convention: a sensor that the rig says to be at q (rig's frame) is really at q plus the shear
///   (xz q_z + xy q_y, yz q_z, 0),
/// each shear an angle for small angles. With turns_sensor = 1 a sensor fixed to the leaning pipe leans with it, by the
/// rotation vector (-yz, xz, 0) of the rig's frame, which takes the upright z axis to (xz, yz, 1); with 0 it stays
/// level. The shear xy of the rows does not turn it.
/// @source geometry, the rotation to first order by hand
Effect jigTiltEffect();

}  // namespace fieldtrue
