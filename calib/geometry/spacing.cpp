#include "calib/geometry/spacing.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/core/statistics.h"

namespace fieldtrue {

double medianSpacing_m(std::span<const Eigen::Vector3d> points_m) {
  if (points_m.size() < 2) return 0.0;
  std::vector<double> nearest_m(points_m.size(), HUGE_VAL);
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    for (std::size_t j = i + 1; j < points_m.size(); ++j) {
      const double apart_m = (points_m[i] - points_m[j]).norm();
      nearest_m[i] = std::min(nearest_m[i], apart_m);
      nearest_m[j] = std::min(nearest_m[j], apart_m);
    }
  }
  return median(std::move(nearest_m));
}

}  // namespace fieldtrue
