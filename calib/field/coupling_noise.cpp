#include "calib/field/coupling_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/error.h"

namespace fieldtrue::field {

GaussianStream::GaussianStream(std::uint64_t seed, std::uint32_t purpose, std::uint32_t index) {
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U), purpose, index};
  generator_.seed(sequence);
}

/// In (0, 1), 53 bits, never 0: its logarithm is finite.
double GaussianStream::uniform() { return (static_cast<double>(generator_() >> 11U) + 0.5) * 0x1p-53; }

double GaussianStream::next() {
  if (spare_) {
    const double value = *spare_;
    spare_.reset();
    return value;
  }
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  const double angle = 2.0 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  return radius * std::cos(angle);
}

Eigen::Vector3d GaussianStream::nextVector() {
  const double x = next();
  const double y = next();
  const double z = next();
  return {x, y, z};
}

CouplingNoise::CouplingNoise(const CouplingNoiseModel& model, std::uint64_t seed, std::uint32_t purpose,
                             std::uint32_t sensor)
    : model_(model), stream_(seed, purpose, sensor) {
  FT_CHECK(model.sd >= 0.0 && model.correlation >= 0.0 && model.correlation < 1.0 && model.rate_hz > 0.0);
}

Eigen::Matrix3d CouplingNoise::at(double time_s) {
  double kept = 0.0;
  if (last_time_s_) {
    const double periods = std::max(1.0, std::round((time_s - *last_time_s_) * model_.rate_hz));
    kept = std::pow(model_.correlation, periods);
  }
  last_time_s_ = time_s;
  const double fresh_sd = std::sqrt(1.0 - kept * kept) * model_.sd;
  for (int column = 0; column < 3; ++column)
    noise_.col(column) = kept * noise_.col(column) + fresh_sd * stream_.nextVector();
  return noise_;
}

}  // namespace fieldtrue::field
