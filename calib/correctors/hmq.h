#pragma once

#include <Eigen/Core>
#include <string>

#include "calib/correctors/fit_checks.h"
#include "calib/correctors/hmq_position.h"
#include "calib/correctors/hmq_r2.h"
#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `hmq`.
PositionMethod hmqPosition();

/// What a multiquadric of positions is fitted to: data that can determine it, visits of a place averaged (an
/// interpolator cannot pass through two values at one place), and the settings.
struct HmqProblem {
  std::string name;
  Places places;
  ChosenR2 r2;
  HmqPrecision precision = HmqPrecision::kDouble;
};

/// @error as checkPositions; kDegenerate for places on a line; as chooseR2
Result<HmqProblem> makeHmqProblem(const FitData& data, const Settings& settings, const RunControl& control);

/// @param dimension spread of the true positions
/// @error kDegenerate below 2
Result<void> checkHmqSpread(const std::string& name, std::size_t n_places, int dimension);

/// True positions of the places, one row each.
Eigen::MatrixXd truthOf(const Places& places);

}  // namespace fieldtrue
