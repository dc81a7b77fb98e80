#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A sensor whose magnetic centre is not where the rig says, or that is mounted turned.
///
/// Convention: with o and w in the sensor's frame and R = tracker_from_sensor as stated, the centre is really at p + R
/// o and the orientation R exp(w). With one orientation the first is the same as a shift of the transmitter; where the
/// alignment is unknown a constant mounting rotation is a part of it.
/// @source Tsai and Lenz 1989, IEEE Trans. RA-5 345 (sensor to mount transform)
Effect sensorOffsetEffect();

}  // namespace fieldtrue
