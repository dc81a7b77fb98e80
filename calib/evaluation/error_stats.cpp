#include "calib/evaluation/error_stats.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/statistics.h"
#include "calib/evaluation/base/resampling.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

ErrorStats errorStats(const std::vector<double>& place_errors, std::uint64_t seed) {
  ErrorStats stats;
  if (place_errors.empty()) return stats;
  const auto n_places = static_cast<double>(place_errors.size());
  stats.mean = std::accumulate(place_errors.begin(), place_errors.end(), 0.0) / n_places;
  stats.median = median(place_errors);
  stats.rms = rootMeanSquare(place_errors);
  stats.p95 = quantile(place_errors, 0.95);
  stats.max = *std::max_element(place_errors.begin(), place_errors.end());
  const Interval interval = bootstrapInterval90(place_errors.size(), seed, [&](std::span<const std::size_t> drawn) {
    double squares = 0.0;
    for (const std::size_t i : drawn) squares += place_errors[i] * place_errors[i];
    return std::sqrt(squares / static_cast<double>(drawn.size()));
  });
  stats.rms_low90 = interval.low;
  stats.rms_high90 = interval.high;
  return stats;
}

}  // namespace fieldtrue::evaluation
