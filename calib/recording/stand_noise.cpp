#include "calib/recording/stand_noise.h"

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>

#include "calib/core/error.h"
#include "calib/recording/autoregression.h"

namespace fieldtrue::recording {

namespace {

using Channels = Eigen::MatrixXd;

constexpr Eigen::Index kCoarser = 4;       ///< From one length of means to the next.
constexpr Eigen::Index kFewestMeans = 40;  ///< Fewer do not tell their scatter.
constexpr double kSureSds = 2.5;           ///< By so much means must scatter more than faster noise lets expect.
constexpr double kLargestLag = 1.0 / 3.0;  ///< Of the stand.
constexpr Eigen::Index kOrder = 12;        ///< Of the noise's autoregression.
constexpr double kStill = 1e-12;
constexpr double kChance = 1e-3;  ///< That noise alone shows a line anywhere.
constexpr double kFine = 0.1;     ///< Frequencies that are looked at, in resolutions of the stand.

Channels centred(const Channels& values) { return values.rowwise() - values.colwise().mean(); }

double autocovariance(const Channels& values, Eigen::Index lag) {
  const Eigen::Index n = values.rows() - lag;
  return (values.topRows(n).array() * values.bottomRows(n).array()).sum() / static_cast<double>(n);
}

/// Of the mean of all rows, summed over the channels. With c the autocovariances about the sample's own mean, whose
/// variance V they lack, V = sum of w (c + V) / n over all lags within the window.
double varianceOfMean(const Channels& values) {
  const Channels left = centred(values);
  const auto n = static_cast<double>(left.rows());
  const auto farthest = static_cast<Eigen::Index>(kLargestLag * n);
  double sum = autocovariance(left, 0), weights = 1.0, pair_before = HUGE_VAL;
  for (Eigen::Index lag = 0; lag + 1 < farthest; lag += 2) {
    const double first = autocovariance(left, lag), second = autocovariance(left, lag + 1);
    if (first + second <= 0.0) break;
    const double scale = std::min(1.0, pair_before / (first + second));
    pair_before = scale * (first + second);
    for (const auto& [at, covariance] : {std::pair{lag, first}, std::pair{lag + 1, second}}) {
      if (at == 0) continue;
      const double weight = 2.0 * (1.0 - static_cast<double>(at) / n);
      sum += weight * scale * covariance;
      weights += weight;
    }
  }
  return sum / (n - weights);
}

Channels meansOf(const Channels& values, Eigen::Index length) {
  Channels means(values.rows() / length, values.cols());
  for (Eigen::Index i = 0; i < means.rows(); ++i) means.row(i) = values.middleRows(i * length, length).colwise().mean();
  return means;
}

/// Channels of unit variance without mean and slope; those that stand still are left out.
Channels movingChannels(const Eigen::VectorXd& times_s, const Channels& values) {
  Eigen::MatrixXd basis(values.rows(), 2);
  basis.col(0).setOnes();
  basis.col(1) = times_s.array() - times_s.mean();
  const Channels left = values - basis * basis.colPivHouseholderQr().solve(values);
  Channels moving(left.rows(), 0);
  for (Eigen::Index channel = 0; channel < left.cols(); ++channel) {
    const double sd = left.col(channel).norm() / std::sqrt(static_cast<double>(left.rows()));
    if (sd <= kStill) continue;
    moving.conservativeResize(Eigen::NoChange, moving.cols() + 1);
    moving.rightCols(1) = left.col(channel) / sd;
  }
  return moving;
}

/// Cosine and sine of a frequency, a column each.
Eigen::MatrixXd waveOf(const Eigen::VectorXd& times_s, double frequency_hz) {
  const Eigen::ArrayXd phases = 2.0 * std::numbers::pi * frequency_hz * times_s.array();
  Eigen::MatrixXd wave(times_s.size(), 2);
  wave << phases.cos(), phases.sin();
  return wave;
}

/// Mean over the channels, 1 for white noise of variance 1.
double powerAt(const Eigen::VectorXd& times_s, const Channels& values, double frequency_hz) {
  const Eigen::MatrixXd sums = waveOf(times_s, frequency_hz).transpose() * values;
  return sums.squaredNorm() / static_cast<double>(values.size());
}

double frequencyOfMost_hz(const Eigen::VectorXd& times_s, const Channels& values, double from_hz, double to_hz,
                          double step_hz) {
  double best_hz = from_hz, most = -1.0;
  for (double at_hz = from_hz; at_hz <= to_hz; at_hz += step_hz) {
    const double power = powerAt(times_s, values, at_hz);
    if (power <= most) continue;
    most = power;
    best_hz = at_hz;
  }
  // The top of the parabola through the largest and its neighbours.
  const double below = powerAt(times_s, values, best_hz - step_hz), above = powerAt(times_s, values, best_hz + step_hz);
  const double bend = below - 2.0 * most + above;
  if (bend >= 0.0) return best_hz;
  return best_hz + step_hz * std::clamp(0.5 * (below - above) / bend, -0.5, 0.5);
}

/// Independent ones that the correlated channels are worth.
double seriesOf(const Channels& values) {
  const Eigen::MatrixXd correlation = values.transpose() * values / static_cast<double>(values.rows());
  return correlation.trace() * correlation.trace() / correlation.squaredNorm();
}

Autoregression noiseOf(const Channels& values, double series) {
  std::vector<double> autocovariances;
  const Eigen::Index most = std::min(kOrder, values.rows() / 4);
  for (Eigen::Index lag = 0; lag <= most; ++lag) {
    const double pairs = static_cast<double>(values.rows() - lag) / static_cast<double>(values.rows());
    autocovariances.push_back(autocovariance(values, lag) * pairs / static_cast<double>(values.cols()));
  }
  return fittedAutoregression(autocovariances, series * static_cast<double>(values.rows()));
}

}  // namespace

double independentReadings(const Eigen::MatrixXd& values) {
  FT_CHECK(values.rows() >= 1);
  const auto n = static_cast<double>(values.rows());
  const double seen = autocovariance(centred(values), 0);
  if (seen <= 0.0) return 1.0;
  double of_mean = varianceOfMean(values);
  for (Eigen::Index length = kCoarser; values.rows() / length >= kFewestMeans; length *= kCoarser) {
    const Channels means = meansOf(values, length);
    const double of_slower = varianceOfMean(means);
    if (of_slower > of_mean * (1.0 + kSureSds * std::sqrt(2.0 / static_cast<double>(means.size()))))
      of_mean = of_slower;
  }
  return std::clamp((seen + of_mean) / of_mean, 1.0, n);
}

std::vector<SpectralLine> linesOfStand(const std::vector<double>& times_s, const Eigen::MatrixXd& values,
                                       const std::vector<SpectralLine>& lines, double within_hz) {
  FT_CHECK(static_cast<Eigen::Index>(times_s.size()) == values.rows());
  if (lines.empty() || values.rows() < 4 * kOrder) return {};
  const Eigen::VectorXd times = Eigen::Map<const Eigen::VectorXd>(times_s.data(), values.rows());
  const double span_s = times[times.size() - 1] - times[0];
  const double rate_hz = static_cast<double>(times.size() - 1) / span_s;
  const Channels all = movingChannels(times, values);
  if (all.cols() == 0) return {};
  Channels left = all;
  std::vector<SpectralLine> refined = lines;
  for (SpectralLine& line : refined) {
    const double from_hz = std::max(line.frequency_hz - within_hz, 0.5 / span_s);
    const double to_hz = std::min(line.frequency_hz + within_hz, 0.5 * rate_hz);
    line.frequency_hz = frequencyOfMost_hz(times, left, from_hz, to_hz, kFine / span_s);
    const Eigen::MatrixXd wave = waveOf(times, line.frequency_hz);
    left -= wave * wave.colPivHouseholderQr().solve(left);
  }
  const double series = seriesOf(left);
  const Autoregression noise = noiseOf(left, series);
  const double searched = 0.5 * static_cast<double>(times.size());
  std::erase_if(refined, [&](SpectralLine& line) {
    const double ratio = powerAt(times, all, line.frequency_hz) / noise.powerAt(line.frequency_hz / rate_hz);
    line.p_value = std::min(1.0, searched * boost::math::gamma_q(series, series * ratio));
    line.error_hz = std::sqrt(1.5 / (series * ratio)) / (std::numbers::pi * span_s);
    return line.p_value > kChance;
  });
  return refined;
}

}  // namespace fieldtrue::recording
