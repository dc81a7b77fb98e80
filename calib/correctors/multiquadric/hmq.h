#pragma once

#include <memory>
#include <string>

#include "calib/core/memory_limit.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/multiquadric/hmq_r2.h"

namespace fieldtrue::correctors {

/// What a multiquadric of positions is fitted to: data that can determine it, visits of a place averaged (an
/// interpolator cannot pass through two values at one place), and the settings.
struct HmqProblem {
  std::string name;
  Places places;
  ChosenR2 r2;
  std::shared_ptr<const MemoryBooking> memory;  ///< Of the fit, or of the fits with places held out.
};

/// @error as checkPositions; as checkSpread; as chooseR2; as MemoryBooking::book
Result<HmqProblem> makeHmqProblem(const FitData& data, const Settings& settings, const RunControl& control);

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
