#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A rig that is larger or smaller than its drawing, along each of its axes: wrong pitch, wet wood, a tape in another
/// unit.
///
/// Convention: a sensor that the rig says to be at q (rig's frame) is really at (1 + diag(s)) q. Which point stays in
/// place does not matter where the alignment is unknown; here it is the rig's origin.
/// @source geometry, by hand
Effect gridScaleEffect();

}  // namespace fieldtrue
