#include "calib/correctors/regrid/regrid_error.h"

#include <cmath>
#include <optional>
#include <vector>

#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::correctors {

RegridError regridError(const FitData& data, const RegridOptions& options, const RunControl& control) {
  const Places places = mergePlaces(data);
  const Regridder regridder(places.p_tracked_m, options);
  std::vector<std::optional<double>> squares_m2(places.size());
  control.parallel_for(places.size(), [&](std::size_t i) {
    const std::vector<RegridWeight> weights = regridder.weightsAt(places.p_tracked_m[i], i);
    if (weights.empty()) return;
    Eigen::Vector3d error_m = places.p_tracked_m[i] - places.p_true_m[i];
    for (const RegridWeight& w : weights)
      error_m += w.weight * (places.p_true_m[w.place] - places.p_tracked_m[w.place]);
    squares_m2[i] = error_m.squaredNorm();
  });
  RegridError error;
  double sum_m2 = 0.0;
  for (const std::optional<double>& square_m2 : squares_m2) {
    ++(square_m2 ? error.n_scored : error.n_without_support);
    sum_m2 += square_m2.value_or(0.0);
  }
  if (error.n_scored > 0) error.rms_mm = 1000.0 * std::sqrt(sum_m2 / static_cast<double>(error.n_scored));
  return error;
}

}  // namespace fieldtrue::correctors
