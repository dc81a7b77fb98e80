#include "calib/evaluation/error_stats.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/statistics.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

ErrorStats errorStats(const std::vector<double>& place_errors, const FitFreedom& freedom) {
  ErrorStats stats;
  if (place_errors.empty()) return stats;
  const auto n_places = static_cast<double>(place_errors.size());
  stats.mean = std::accumulate(place_errors.begin(), place_errors.end(), 0.0) / n_places;
  stats.median = median(place_errors);
  stats.rms = rootMeanSquare(place_errors);
  stats.p95 = quantile(place_errors, 0.95);
  stats.max = *std::max_element(place_errors.begin(), place_errors.end());
  const Interval interval = rmsInterval90(place_errors, freedom);
  stats.rms_low90 = interval.low;
  stats.rms_high90 = interval.high;
  return stats;
}

}  // namespace fieldtrue::evaluation
