#include "calib/recording/noise_elsewhere.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/recording/autoregression.h"
#include "calib/recording/relaxation_noise.h"

namespace fieldtrue::recording {

namespace {

constexpr int kFarthestSlow = 40;  ///< Bins to which slow noise is fitted.
/// Enough for an autoregression to fill what is left out with what it says itself.
constexpr int kFillings = 12;
constexpr Eigen::Index kHighestOrder = 24;  ///< Of the noise's autoregression.

/// What exponential variables have for a mean that have this one once they are cut at the highest power.
double uncutMean(double shown) {
  double mean = shown;
  for (int step = 0; step < 30; ++step) mean = shown / -std::expm1(-kHighestPower / mean);
  return mean;
}

bool isLeftOut(Eigen::Index bin, double at) { return std::abs(static_cast<double>(bin) - at) < kPerResolution; }

}  // namespace

NoiseElsewhere::NoiseElsewhere(const std::vector<Part>& parts, const std::vector<Part>& white, double rate_hz,
                               double step_hz, double series, double rho)
    : white_(white), n_values_(series * static_cast<double>(medianLength(white))) {
  for (int bin = 0; bin * step_hz <= 0.5 * rate_hz * (1.0 + 1e-9); ++bin) grid_hz_.push_back(bin * step_hz);
  std::vector<double> low;
  for (std::size_t bin = 0; bin < std::min<std::size_t>(grid_hz_.size(), kFarthestSlow); ++bin)
    low.push_back(grid_hz_[bin] / rate_hz);
  const Part& part = ofMedianLength(parts);
  shapes_ = relaxationPowers((part.times_s * rate_hz).array().round(), rho, low);
}

double NoiseElsewhere::powerAt(double frequency_hz) const {
  const std::vector<double> shown = pooledPower(withoutSinusoid(white_, frequency_hz), grid_hz_);
  Eigen::VectorXd power(static_cast<Eigen::Index>(shown.size()));
  for (std::size_t bin = 0; bin < shown.size(); ++bin)
    power[static_cast<Eigen::Index>(bin)] = uncutMean(std::clamp(shown[bin], 1e-9, 0.99 * kHighestPower));
  const double at = frequency_hz / grid_hz_[1];
  const double expected = autoregressive(power, at);
  return at < kFirstBin + kFarthest ? std::max(expected, slow(power, at)) : expected;
}

double NoiseElsewhere::slow(const Eigen::VectorXd& power, double at) const {
  std::vector<Eigen::Index> others;
  for (Eigen::Index bin = 1; bin < shapes_.rows(); ++bin)
    if (!isLeftOut(bin, at)) others.push_back(bin);
  const Eigen::MatrixXd shapes = shapes_(others, Eigen::all);
  return shapes_.row(std::lround(at)).dot(likeliestSum(shapes, power(others)));
}

/// What was left out, and what mean and slope have taken, is filled with what the autoregression itself says of it.
double NoiseElsewhere::autoregressive(Eigen::VectorXd power, double at) const {
  const auto length = static_cast<double>(power.size() - 1);
  const Eigen::Index order = std::min(kHighestOrder, power.size() / 3);
  Autoregression noise;
  for (Eigen::Index bin = 0; bin < power.size(); ++bin)
    if (bin < 2 || isLeftOut(bin, at)) power[bin] = power[std::min(bin + 2 * kPerResolution, power.size() - 1)];
  for (int round = 0; round < kFillings; ++round) {
    std::vector<double> covariances;
    for (Eigen::Index lag = 0; lag <= order; ++lag) {
      double sum = -0.5 * (power[0] + (lag % 2 == 0 ? 1.0 : -1.0) * power[power.size() - 1]);
      for (Eigen::Index bin = 0; bin < power.size(); ++bin)
        sum += power[bin] * std::cos(std::numbers::pi * static_cast<double>(bin * lag) / length);
      covariances.push_back(sum / length);
    }
    noise = fittedAutoregression(covariances, n_values_);
    for (Eigen::Index bin = 0; bin < power.size(); ++bin)
      if (bin < 2 || isLeftOut(bin, at)) power[bin] = noise.powerAt(static_cast<double>(bin) / (2.0 * length));
  }
  return noise.powerAt(at / (2.0 * length));
}

}  // namespace fieldtrue::recording
