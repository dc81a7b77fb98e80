#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Coils, amplifiers or their stored calibration that are stronger or weaker than the tracker believes, each by its own
/// share.
///
/// Convention: the couplings become S' = (1 + diag(g_rx)) S (1 + diag(g_tx)); to first order the field matrix at the
/// sensor changes by
///   dG = G diag(g_tx) + R diag(g_rx) R^T G,   R = tracker_from_sensor,
/// so a transmitter's gain scales a column of S and a receiver's a row.
/// @source coupling matrix: Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; its change to first order by hand
Effect coilGainEffect();

}  // namespace fieldtrue
