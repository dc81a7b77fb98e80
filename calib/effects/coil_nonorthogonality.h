#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Coils that do not stand at right angles to each other though the tracker believes so.
///
/// Convention: the couplings become S' = (1 + E_rx) S (1 + E_tx) with E symmetric and zero on the diagonal: E_xy is the
/// angle by which coil x leans toward y and coil y toward x, so the angle between them is 90 deg - 2 E_xy. (The
/// antisymmetric part is a rotation of the whole set of coils.) To first order
///   dG = G E_tx + R E_rx R^T G,   R = tracker_from_sensor.
/// @source coupling matrix: Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; its change to first order by hand
Effect coilNonorthogonalityEffect();

}  // namespace fieldtrue
