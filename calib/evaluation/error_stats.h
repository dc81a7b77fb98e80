#pragma once

#include <vector>

#include "calib/evaluation/base/intervals.h"

namespace fieldtrue::evaluation {

/// Statistics of per-place errors, in mm or degrees; the error of a place is the RMS over its rows.
/// @see rmsInterval90
struct ErrorStats {
  double mean = 0, median = 0, rms = 0, p95 = 0, max = 0, rms_low90 = 0, rms_high90 = 0;
};

ErrorStats errorStats(const std::vector<double>& place_errors, const FitFreedom& freedom = {});

}  // namespace fieldtrue::evaluation
