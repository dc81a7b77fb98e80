#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Coils of real size where the tracker's electronics believe in dipoles.
///
/// Three concentric rings of radius a stand in for the transmitter's or the receiver's coils, each with the dipole
/// moment (or the effective area) that the tracker was calibrated for. A transmitter ring of axis k has the field of
/// unit current 4 h(p)/a^2 for C = 1; a receiver ring reads, by reciprocity, 4 h(t)/a^2. To leading order in a/r
///   dS_ik = -(a^2/8) D(e_i, e_k, e_k, e_k) for transmitter rings, D(e_i, e_i, e_i, e_k) for receiver rings,
/// with D the fourth derivative of 1/r at the sensor; a square coil of half side b acts as a = sqrt(4/3) b.
/// @source Jackson 1999, Classical Electrodynamics, section 5.5 (ring) and its expansion in a/r; square: second moment
/// of the wound area
Effect finiteCoilEffect();

}  // namespace fieldtrue
