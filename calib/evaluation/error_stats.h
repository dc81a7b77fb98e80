#pragma once

#include <cstdint>
#include <vector>

namespace fieldtrue::evaluation {

/// Statistics of per-place errors, in mm or degrees; the error of a place is the RMS over its rows. The 90 % interval
/// of the RMS is a percentile bootstrap over places.
struct ErrorStats {
  double mean = 0, median = 0, rms = 0, p95 = 0, max = 0, rms_low90 = 0, rms_high90 = 0;
};

/// @param seed of the bootstrap
ErrorStats errorStats(const std::vector<double>& place_errors, std::uint64_t seed = 1);

}  // namespace fieldtrue::evaluation
