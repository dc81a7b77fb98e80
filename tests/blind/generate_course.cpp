#include <algorithm>
#include <cmath>

#include "tests/blind/generate_effects.h"

namespace blind {
namespace {

/// On straight lines between values spread evenly over 0..1.
double between(ShapeChange values, double share) {
  if (values.empty()) return 0.0;
  const auto last = static_cast<double>(values.size() - 1);
  const double at = std::clamp(share, 0.0, 1.0) * last;
  const auto below = static_cast<std::size_t>(std::min(std::floor(at), last - 1));
  return values[below] + (at - static_cast<double>(below)) * (values[below + 1] - values[below]);
}

}  // namespace

std::function<double(double, ShapeChange)> wanderingCourse(const Setup& setup, Random& random) {
  const double end_s = setup.duration_s(), constant_s = uniform(random, 0.2, 0.7) * end_s;
  const double share = uniform(random, 0, 0.5);
  std::vector<double> walk{0.0};
  for (int step = 0; step < 200; ++step) walk.push_back(walk.back() + normal(random) / std::sqrt(200.0));
  return [=](double time_s, ShapeChange change) {
    const double at = std::min(199.999, 200 * time_s / end_s);
    const auto k = static_cast<std::size_t>(at);
    const double step = walk[k] + (at - static_cast<double>(k)) * (walk[k + 1] - walk[k]);
    return (1 - share) * (1 - std::exp(-time_s / constant_s)) + share * step + between(change, time_s / end_s);
  };
}

}  // namespace blind
