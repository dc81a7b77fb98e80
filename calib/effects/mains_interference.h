#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Mains wiring or a monitor whose magnetic field the receiver picks up beside the transmitter's.
///
/// Convention: a line of frequency f adds to the couplings, at the time t of a reading,
///   dS_ik = amplitude d_i cos(2 pi f t + phase + 2 pi k/3),
/// d the direction in the sensor's axes, of length 1, and k the transmitter's coil: the three are told apart one after
/// the other within a cycle, so each meets the line at another phase. Aliasing follows from when readings are taken: at
/// the rate fs a line shows at |f - n fs|. Where that is 0 it is a constant during a visit. Mains and tracker run on
/// clocks of their own, so between two visits the phase is lost.
/// @source Oppenheim and Schafer 1989, Discrete-Time Signal Processing, section 3.2 (aliasing)
Effect mainsInterferenceEffect();

}  // namespace fieldtrue
