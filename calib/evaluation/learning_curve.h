#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// Held-out error of a method fitted on a part of the places.
struct LearningPoint {
  int n_places = 0;  ///< Fitted on.
  double rms = 0.0;  ///< mm; median over the draws.
  double low = 0.0;  ///< Smallest and largest over the draws.
  double high = 0.0;
};
struct LearningCurve {
  std::string method;
  Settings settings;
  std::vector<LearningPoint> points;  ///< Ascending in n_places; places that are too few for the method are left out.
};

/// Held-out error against the number of places used: a fifth of the places is held out for all, and growing random
/// parts of the rest are fitted, several draws each.
/// @error as compareMethods
Result<std::vector<LearningCurve>> learningCurves(const CalibrationTable& table, const ComparisonOptions& options,
                                                  const RunControl& control = {});

nlohmann::json toJson(const LearningCurve& curve);

}  // namespace fieldtrue::evaluation
