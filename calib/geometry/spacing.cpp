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

std::vector<std::size_t> spreadPlaces(std::span<const Eigen::Vector3d> p_m, std::size_t count) {
  std::vector<std::size_t> chosen;
  if (p_m.size() <= count) {
    for (std::size_t i = 0; i < p_m.size(); ++i) chosen.push_back(i);
    return chosen;
  }
  std::vector<bool> taken(p_m.size(), false);
  std::vector<double> nearest_m2(p_m.size(), HUGE_VAL);
  const auto take = [&](std::size_t i) {
    taken[i] = true;
    chosen.push_back(i);
    for (std::size_t j = 0; j < p_m.size(); ++j)
      nearest_m2[j] = std::min(nearest_m2[j], (p_m[j] - p_m[i]).squaredNorm());
  };
  take(0);
  while (chosen.size() < (count + 1) / 2)
    take(static_cast<std::size_t>(std::max_element(nearest_m2.begin(), nearest_m2.end()) - nearest_m2.begin()));
  const std::size_t n_anchors = chosen.size();
  for (std::size_t k = 0; k < n_anchors && chosen.size() < count; ++k) {
    std::size_t nearest = p_m.size();
    for (std::size_t j = 0; j < p_m.size(); ++j)
      if (!taken[j] && (nearest == p_m.size() ||
                        (p_m[j] - p_m[chosen[k]]).squaredNorm() < (p_m[nearest] - p_m[chosen[k]]).squaredNorm()))
        nearest = j;
    taken[nearest] = true;
    chosen.push_back(nearest);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace fieldtrue
