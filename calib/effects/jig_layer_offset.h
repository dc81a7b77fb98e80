#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Layers of a rig that are too high or too low: pipes cut to the wrong length, a shelf on another peg.
///
/// Convention: a sensor in the layer at the height h along one of the rig's axes is really at h + offset. It belongs to
/// the nearest layer of the list, and to none where that is farther than half the smallest spacing of the list.
/// @source geometry, by hand
Effect jigLayerOffsetEffect();

}  // namespace fieldtrue
