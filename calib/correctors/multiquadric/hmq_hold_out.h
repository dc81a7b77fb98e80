#pragma once

#include <memory>

#include "calib/correctors/base/method.h"

namespace fieldtrue::correctors {

/// Multiquadrics with places left out, from one inverse of the system of all. With M^-1 the inverse, alpha = M^-1 v and
/// B the places left out, the rest has alpha_rest = (alpha - M^-1_{.,B} (M^-1_BB)^-1 alpha_B)_rest. Alphas of q and of
/// the constant 1 are kept apart, so that any rigid change of the true positions applies afterwards.
///
/// Where only some visits of a place are left out, its averaged position moves and the form above does not hold; where
/// the downdated field misses a place by more than a micrometre, rounding has spoilt it. Both are fitted anew.
/// @source Rippa 1999, eq. 5, for blocks
/// @error as the fit
Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutHmq(const FitData& data, const Settings& settings,
                                                               const RunControl& control);

}  // namespace fieldtrue::correctors
