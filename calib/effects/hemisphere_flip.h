#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Visits at which the tracker reports the other of the two positions that its signals allow.
///
/// Convention: the field of dipoles is even, S(p) = S(-p), so a tracker that lost its hemisphere reports -p with the
/// right orientation; each visit does so, all its readings together, with this probability.
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (hemisphere ambiguity)
Effect hemisphereFlipEffect();

}  // namespace fieldtrue
