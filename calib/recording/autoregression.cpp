#include "calib/recording/autoregression.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace fieldtrue::recording {

double Autoregression::powerAt(double frequency) const {
  std::complex<double> transfer = 1.0;
  for (std::size_t k = 0; k < coefficients.size(); ++k)
    transfer -= coefficients[k] * std::polar(1.0, -2.0 * std::numbers::pi * frequency * static_cast<double>(k + 1));
  return variance / std::norm(transfer);
}

Autoregression fittedAutoregression(std::span<const double> autocovariances, double n_values) {
  Autoregression at{{}, autocovariances[0]};
  Autoregression best = at;
  double least = n_values * std::log(at.variance);
  for (std::size_t order = 1; order < autocovariances.size(); ++order) {
    double sum = autocovariances[order];
    for (std::size_t k = 0; k < at.coefficients.size(); ++k) sum -= at.coefficients[k] * autocovariances[order - 1 - k];
    const double reflection = sum / at.variance;
    std::vector<double> next = at.coefficients;
    for (std::size_t k = 0; k < next.size(); ++k) next[k] -= reflection * at.coefficients[next.size() - 1 - k];
    next.push_back(reflection);
    at = {std::move(next), at.variance * (1.0 - reflection * reflection)};
    const double cost = n_values * std::log(at.variance) + static_cast<double>(order) * std::log(n_values);
    if (cost >= least) continue;
    least = cost;
    best = at;
  }
  return best;
}

}  // namespace fieldtrue::recording
