#pragma once

#include <vector>

namespace fieldtrue::evaluation {

/// Statistics of per-place errors, in mm or degrees; the error of a place is the RMS over its rows.
/// @see rmsInterval90
struct ErrorStats {
  double mean = 0, median = 0, rms = 0, p95 = 0, max = 0, rms_low90 = 0, rms_high90 = 0;
};

/// @param is_tuned whether the method they are of chose more than coefficients from the data
ErrorStats errorStats(const std::vector<double>& place_errors, bool is_tuned = false);

}  // namespace fieldtrue::evaluation
