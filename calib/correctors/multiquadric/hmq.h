#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "calib/core/memory_limit.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/multiquadric/hmq_position.h"
#include "calib/correctors/multiquadric/hmq_r2.h"

namespace fieldtrue::correctors {

/// What a multiquadric of positions is fitted to: data that can determine it, visits of a place averaged (an
/// interpolator cannot pass through two values at one place), and the settings.
struct HmqProblem {
  std::string name;
  Places places;
  ChosenR2 r2;
  HmqPrecision precision = HmqPrecision::kDouble;
  std::shared_ptr<const MemoryBooking> memory;  ///< Of the fit, or of the fits with places held out.
};

/// @error as checkPositions; kDegenerate for places on a line; as chooseR2; as MemoryBooking::book
Result<HmqProblem> makeHmqProblem(const FitData& data, const Settings& settings, const RunControl& control);

/// @param dimension spread of the true positions
/// @error kDegenerate below 2
Result<void> checkHmqSpread(const std::string& name, std::size_t n_places, int dimension);

/// True positions of the places, one row each.
Eigen::MatrixXd truthOf(const Places& places);

}  // namespace fieldtrue::correctors
