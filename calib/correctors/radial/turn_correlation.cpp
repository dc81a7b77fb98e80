#include "calib/correctors/radial/turn_correlation.h"

#include <algorithm>

namespace fieldtrue::correctors {

// c^2 = 4 sin^2(angle/2) = 4 (1 - (q . q')^2).
void squaredChords(double length_rad, const Eigen::Quaterniond& q, std::span<const Eigen::Quaterniond> others,
                   double* squares) {
  const double scale = 4.0 / (length_rad * length_rad);
  for (std::size_t i = 0; i < others.size(); ++i) {
    const double cosine = q.coeffs().dot(others[i].coeffs());
    squares[i] = scale * std::max(0.0, 1.0 - cosine * cosine);
  }
}

void turnCorrelation(RadialKernel kernel, double turn_length_rad, const Eigen::Quaterniond& q,
                     std::span<const Eigen::Quaterniond> others, double* correlation) {
  squaredChords(turn_length_rad, q, others, correlation);
  radialValues(kernel, 0.0, correlation, others.size(), correlation);
}

Eigen::VectorXd turnCorrelation(RadialKernel kernel, double turn_length_rad, const Eigen::Quaterniond& q,
                                std::span<const Eigen::Quaterniond> others) {
  Eigen::VectorXd correlation(static_cast<Eigen::Index>(others.size()));
  turnCorrelation(kernel, turn_length_rad, q, others, correlation.data());
  return correlation;
}

}  // namespace fieldtrue::correctors
