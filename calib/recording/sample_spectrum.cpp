#include "calib/recording/sample_spectrum.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/statistics.h"
#include "calib/recording/autoregression.h"
#include "calib/recording/relaxation_noise.h"

namespace fieldtrue::recording {

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr std::size_t kFewestSpectrumReadings = 16;
constexpr std::size_t kFewestStops = 4;
constexpr std::size_t kMostStops = 1500;
constexpr std::size_t kLongestPart = 128;
constexpr double kStandsStill = 1e-12;
/// One part with a jump in it may not pass for a line in all: its powers are cut here. exp(-12) of noise is.
constexpr double kHighestPower = 12.0;
/// Frequencies half the parts' resolution apart.
constexpr int kPerResolution = 2;
/// Below 2 periods a part cannot tell a line from drift, nor are there neighbours below it.
constexpr int kFirstBin = 4;
constexpr int kNearest = 3;  ///< Neighbourhood of a frequency, in bins to either side.
constexpr int kFarthest = 9;
constexpr int kFarthestSlow = 40;  ///< Bins to which slow noise is fitted.
/// Enough for an autoregression to fill what is left out with what it says itself.
constexpr int kFillings = 12;
constexpr std::size_t kMostLines = 3;
constexpr double kLargestChance = 1e-3;
/// A line that adds less than this share to the noise's power does no harm that could be seen.
constexpr double kSmallestExcess = 0.2;
/// The same below 4 and below 6.5 periods a part, where noise known mostly from above may hide a broad hump. One three
/// resolutions wide (second order, pole radius 0.85) stood out by 1.7 at most and by 0.5.
constexpr double kSmallestLowestExcess = 2.0;
constexpr double kSmallestLowExcess = 0.6;
constexpr Eigen::Index kHighestOrder = 24;  ///< Of the noise's autoregression.

/// A stop's readings, or a part of a long stop's: channels of unit variance, one reading a row.
struct Part {
  Eigen::VectorXd times_s;  ///< From the part's first reading.
  Eigen::MatrixXd values;
};

/// Scales the channels to unit variance; those that stand still are left out.
Eigen::MatrixXd scaled(const Eigen::MatrixXd& values) {
  const Eigen::RowVectorXd sd = (values.array().square().colwise().sum() / static_cast<double>(values.rows())).sqrt();
  std::vector<Eigen::Index> moving;
  for (Eigen::Index channel = 0; channel < values.cols(); ++channel) {
    if (sd[channel] > kStandsStill) moving.push_back(channel);
  }
  Eigen::MatrixXd to(values.rows(), static_cast<Eigen::Index>(moving.size()));
  for (std::size_t k = 0; k < moving.size(); ++k) {
    to.col(static_cast<Eigen::Index>(k)) = values.col(moving[k]) / sd[moving[k]];
  }
  return to;
}

/// How many independent channels the correlated ones of all parts are worth: tr(C)^2 / tr(C^2).
double independentSeries(const std::vector<Part>& parts) {
  double series = 0.0;
  for (const Part& part : parts) {
    const Eigen::MatrixXd correlation = part.values.transpose() * part.values / static_cast<double>(part.values.rows());
    const double channels = correlation.trace();
    series += channels * channels / correlation.squaredNorm();
  }
  return series;
}

/// Times as the rate has them where the recorded ones are too coarse or stand still.
Eigen::VectorXd partTimes_s(const SampleVisit& visit, std::size_t first, std::size_t count, double rate_hz) {
  Eigen::VectorXd times_s(static_cast<Eigen::Index>(count));
  double last = -1.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double step = std::round((visit.times_s[first + i] - visit.times_s[first]) * rate_hz);
    last = std::max(step, last + 1.0);
    times_s[static_cast<Eigen::Index>(i)] = last / rate_hz;
  }
  return times_s;
}

std::vector<Part> partsOf(const std::vector<SampleVisit>& visits, double rate_hz) {
  std::vector<Part> parts;
  const std::size_t stops = std::min(visits.size(), kMostStops);
  for (std::size_t s = 0; s < stops; ++s) {
    const SampleVisit& visit = visits[s * visits.size() / stops];
    const std::size_t n = visit.times_s.size();
    const std::size_t pieces = std::min<std::size_t>((n + kLongestPart - 1) / kLongestPart, 16);
    const std::size_t length = std::min(n / pieces, kLongestPart);
    if (length < kFewestSpectrumReadings) continue;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      Part part;
      part.times_s = partTimes_s(visit, piece * length, length, rate_hz);
      const auto first = static_cast<Eigen::Index>(piece * length);
      const Eigen::MatrixXd rows = visit.deviations.middleRows(first, static_cast<Eigen::Index>(length));
      part.values = scaled(detrended(part.times_s, rows));
      if (part.values.cols() > 0) parts.push_back(std::move(part));
    }
  }
  return parts;
}

/// What the correlation of successive readings comes out as, after mean and slope are taken off n readings of
/// first-order noise: sum of E[x_k x_(k+1)] over sum of E[x_k^2], exactly.
double shownCorrelation(double rho, Eigen::Index n) {
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) covariance(i, j) = std::pow(rho, static_cast<double>(std::abs(i - j)));
  }
  const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1));
  const Eigen::MatrixXd left = detrended(times, detrended(times, covariance).transpose());
  return left.diagonal(1).sum() / left.trace();
}

/// Correlation of successive readings over all parts, without the bias that fitting mean and slope brings.
double pooledCorrelation(const std::vector<Part>& parts) {
  double products = 0.0, squares = 0.0, n_readings = 0.0;
  for (const Part& part : parts) {
    const Eigen::Index n = part.values.rows();
    products += (part.values.topRows(n - 1).array() * part.values.bottomRows(n - 1).array()).sum();
    squares += part.values.squaredNorm();
    n_readings += static_cast<double>(n);
  }
  const double shown = products / squares;
  const auto n = static_cast<Eigen::Index>(std::llround(n_readings / static_cast<double>(parts.size())));
  double low = -0.95, high = 0.99;
  for (int halving = 0; halving < 20; ++halving) {
    const double middle = 0.5 * (low + high);
    // A ratio of two sums that share their scatter falls short by 2 rho/n (Marriott and Pope 1954).
    const double expected = shownCorrelation(middle, n) - 2.0 * middle / static_cast<double>(n);
    (expected < shown ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Differences x_k - rho x_(k-1): white where the noise is autoregressive of first order.
std::vector<Part> prewhitened(const std::vector<Part>& parts, double rho) {
  std::vector<Part> white;
  for (const Part& part : parts) {
    const Eigen::Index n = part.values.rows();
    Part to;
    to.times_s = part.times_s.tail(n - 1);
    to.values = detrended(to.times_s, part.values.bottomRows(n - 1) - rho * part.values.topRows(n - 1));
    to.values = scaled(to.values);
    white.push_back(std::move(to));
  }
  return white;
}

/// Power of every channel at every frequency, 1 for white noise.
Eigen::MatrixXd partPower(const Part& part, const std::vector<double>& frequencies_hz) {
  const Eigen::Index n = part.values.rows();
  Eigen::MatrixXd cosines(static_cast<Eigen::Index>(frequencies_hz.size()), n);
  Eigen::MatrixXd sines = cosines;
  for (Eigen::Index f = 0; f < cosines.rows(); ++f) {
    const double omega = kTwoPi * frequencies_hz[static_cast<std::size_t>(f)];
    cosines.row(f) = (omega * part.times_s.transpose().array()).cos();
    sines.row(f) = (omega * part.times_s.transpose().array()).sin();
  }
  return ((cosines * part.values).array().square() + (sines * part.values).array().square()) / static_cast<double>(n);
}

std::vector<double> pooledPower(const std::vector<Part>& parts, const std::vector<double>& frequencies_hz) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(frequencies_hz.size()));
  double series = 0.0;
  for (const Part& part : parts) {
    sum += partPower(part, frequencies_hz).cwiseMin(kHighestPower).rowwise().sum();
    series += static_cast<double>(part.values.cols());
  }
  sum /= series;
  return {sum.data(), sum.data() + sum.size()};
}

/// Value at 0 of a robust parabola through logarithms of power at distances in bins.
double parabolaAtZero(const std::vector<double>& distances, const std::vector<double>& logs) {
  const auto n = static_cast<Eigen::Index>(logs.size());
  Eigen::MatrixXd basis(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double d = distances[static_cast<std::size_t>(i)] / kFarthest;
    basis.row(i) << 1.0, d, d * d;
  }
  const Eigen::Map<const Eigen::VectorXd> values(logs.data(), n);
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(n);
  Eigen::Vector3d fit = Eigen::Vector3d::Zero();
  for (int round = 0; round < 4; ++round) {
    fit = (basis.transpose() * weights.asDiagonal() * basis)
              .ldlt()
              .solve(basis.transpose() * weights.asDiagonal() * values);
    const Eigen::VectorXd misfits = (values - basis * fit).cwiseAbs();
    const double scale = 2.0 * median({misfits.data(), misfits.data() + n}) + 1e-6;
    weights = (scale * misfits.cwiseMax(1e-12).cwiseInverse()).cwiseMin(1.0);
  }
  return fit[0];
}

double medianBetween(const std::vector<double>& values, int first, int last) {
  const int from = std::max(first, 0);
  const int to = std::min(last, static_cast<int>(values.size()) - 1);
  if (to - from < 2) return 0.0;
  return median(std::vector<double>(values.begin() + from, values.begin() + to + 1));
}

/// A parabola across a bin from its neighbours on both sides, mirrored at half the rate, about which noise is
/// symmetric; 0 near the lowest frequency.
double parabolaAcross(const std::vector<double>& power, int bin) {
  const int last = static_cast<int>(power.size()) - 1;
  if (bin < kFarthest || last < 2 * kFarthest) return 0.0;
  std::vector<double> distances, logs;
  for (int d = -kFarthest; d <= kFarthest; ++d) {
    const int neighbour = bin + d > last ? 2 * last - bin - d : bin + d;
    if (std::abs(d) < kNearest || std::abs(neighbour - bin) < kNearest) continue;
    distances.push_back(d);
    logs.push_back(std::log(std::max(power[static_cast<std::size_t>(neighbour)], 1e-12)));
  }
  return std::exp(parabolaAtZero(distances, logs));
}

std::size_t medianLength(const std::vector<Part>& parts) {
  std::vector<double> lengths;
  for (const Part& part : parts) lengths.push_back(static_cast<double>(part.values.rows()));
  return static_cast<std::size_t>(median(std::move(lengths)));
}

const Part& ofMedianLength(const std::vector<Part>& parts) {
  const auto length = static_cast<Eigen::Index>(medianLength(parts));
  return *std::min_element(parts.begin(), parts.end(), [&](const Part& a, const Part& b) {
    return std::abs(a.values.rows() - length) < std::abs(b.values.rows() - length);
  });
}

/// What exponential variables have for a mean that have this one once they are cut at the highest power.
double uncutMean(double shown) {
  double mean = shown;
  for (int step = 0; step < 30; ++step) mean = shown / -std::expm1(-kHighestPower / mean);
  return mean;
}

double stepOf_hz(const SampleSpectrum& spectrum) { return spectrum.frequencies_hz[1] - spectrum.frequencies_hz[0]; }

/// The parts without sinusoids of the lines' frequencies.
std::vector<Part> withoutLines(const std::vector<Part>& parts, const std::vector<SpectralLine>& lines) {
  std::vector<Part> left = parts;
  for (const SpectralLine& line : lines) {
    for (Part& part : left) {
      Eigen::MatrixXd basis(part.values.rows(), 2);
      basis.col(0) = (kTwoPi * line.frequency_hz * part.times_s.array()).cos();
      basis.col(1) = (kTwoPi * line.frequency_hz * part.times_s.array()).sin();
      part.values -= basis * basis.colPivHouseholderQr().solve(part.values);
    }
  }
  return left;
}

/// What the noise shows at a frequency by all others: the readings' autoregression, which knows a filter's lobe or a
/// hand's sway, and at the low end, where few neighbours are below or none, the likeliest slow noise.
class NoiseElsewhere {
 public:
  NoiseElsewhere(const std::vector<Part>& parts, const std::vector<Part>& white, const SampleSpectrum& spectrum,
                 double rho)
      : white_(white), n_values_(spectrum.series * static_cast<double>(medianLength(white))) {
    const double step_hz = stepOf_hz(spectrum);
    for (int bin = 0; bin * step_hz <= 0.5 * spectrum.rate_hz * (1.0 + 1e-9); ++bin) grid_hz_.push_back(bin * step_hz);
    std::vector<double> low;
    for (std::size_t bin = 0; bin < std::min<std::size_t>(grid_hz_.size(), kFarthestSlow); ++bin)
      low.push_back(grid_hz_[bin] / spectrum.rate_hz);
    const Part& part = ofMedianLength(parts);
    shapes_ = relaxationPowers((part.times_s * spectrum.rate_hz).array().round(), rho, low);
  }

  double powerAt(double frequency_hz) const {
    SpectralLine line;
    line.frequency_hz = frequency_hz;
    const std::vector<double> shown = pooledPower(withoutLines(white_, {line}), grid_hz_);
    Eigen::VectorXd power(static_cast<Eigen::Index>(shown.size()));
    for (std::size_t bin = 0; bin < shown.size(); ++bin)
      power[static_cast<Eigen::Index>(bin)] = uncutMean(std::clamp(shown[bin], 1e-9, 0.99 * kHighestPower));
    const double at = frequency_hz / grid_hz_[1];
    const double expected = autoregressive(power, at);
    return at < kFirstBin + kFarthest ? std::max(expected, slow(power, at)) : expected;
  }

 private:
  bool isLeftOut(Eigen::Index bin, double at) const { return std::abs(static_cast<double>(bin) - at) < kPerResolution; }

  double slow(const Eigen::VectorXd& power, double at) const {
    std::vector<Eigen::Index> others;
    for (Eigen::Index bin = 1; bin < shapes_.rows(); ++bin)
      if (!isLeftOut(bin, at)) others.push_back(bin);
    const Eigen::MatrixXd shapes = shapes_(others, Eigen::all);
    return shapes_.row(std::lround(at)).dot(likeliestSum(shapes, power(others)));
  }

  /// What was left out, and what mean and slope have taken, is filled with what the autoregression itself says of it.
  double autoregressive(Eigen::VectorXd power, double at) const {
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

  const std::vector<Part>& white_;
  double n_values_;
  std::vector<double> grid_hz_;
  Eigen::MatrixXd shapes_;  ///< Of the lowest bins of the grid.
};

/// What the neighbourhood of each frequency, itself left out, says of the noise there at most: neither a slope nor the
/// top of a filter's lobe is a line.
std::vector<double> neighbourhood(const std::vector<double>& power) {
  std::vector<double> background;
  for (int bin = 0; bin < static_cast<int>(power.size()); ++bin)
    background.push_back(std::max({medianBetween(power, bin - kFarthest, bin - kNearest),
                                   medianBetween(power, bin + kNearest, bin + kFarthest), parabolaAcross(power, bin)}));
  return background;
}

/// Upper tail of the mean of as many exponential variables over a background known from a neighbourhood as wide as
/// two of them; cube root made normal (Wilson and Hilferty 1931).
double chanceOf(double ratio, double series) {
  const double a = 1.0 / (9.0 * series);
  const double b = a / 2.0;
  const double cube_root = std::cbrt(ratio);
  const double z = ((1.0 - b) * cube_root - (1.0 - a)) / std::sqrt(b * cube_root * cube_root + a);
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

/// The frequency near a bin at which most power is.
double refined_hz(const std::vector<Part>& parts, double bin_hz, double step_hz) {
  std::vector<double> fine_hz;
  for (int k = -8; k <= 8; ++k) fine_hz.push_back(bin_hz + step_hz * k / 8.0);
  const std::vector<double> power = pooledPower(parts, fine_hz);
  const auto peak = std::max_element(power.begin(), power.end());
  return fine_hz[static_cast<std::size_t>(peak - power.begin())];
}

/// Transmission of the prewhitening filter 1 - rho z^-1 at a frequency.
double prewhiteningGain(double frequency_hz, double rate_hz, double rho) {
  return 1.0 + rho * rho - 2.0 * rho * std::cos(kTwoPi * frequency_hz / rate_hz);
}

/// The bin that stands out most of its neighbourhood, of those not near a line found before nor refused.
std::size_t highestBin(const SampleSpectrum& spectrum, const std::vector<bool>& refused) {
  const double step_hz = stepOf_hz(spectrum);
  const auto ratio = [&](std::size_t bin) {
    return spectrum.background[bin] > 0.0 ? spectrum.power[bin] / spectrum.background[bin] : 0.0;
  };
  std::size_t peak = spectrum.power.size();
  for (std::size_t bin = 0; bin < spectrum.power.size(); ++bin) {
    const bool is_taken = std::any_of(spectrum.lines.begin(), spectrum.lines.end(), [&](const SpectralLine& line) {
      return std::abs(line.frequency_hz - spectrum.frequencies_hz[bin]) < 3.0 * kPerResolution * step_hz;
    });
    if (is_taken || refused[bin] || ratio(bin) <= (peak < spectrum.power.size() ? ratio(peak) : 0.0)) continue;
    peak = bin;
  }
  return peak;
}

/// @param bin from the first that is looked at
double leastExcess(std::size_t bin) {
  constexpr int kLowest = 4 * kPerResolution - kFirstBin;  // Below 4 periods a part.
  if (bin < kLowest) return kSmallestLowestExcess;
  return bin < kFarthest ? kSmallestLowExcess : kSmallestExcess;
}

/// That power stands out of its background as much by chance at any of the frequencies.
double chanceAt(const SampleSpectrum& spectrum, std::size_t bin) {
  const double ratio = spectrum.power[bin] / spectrum.background[bin];
  if (ratio < 1.0 + leastExcess(bin)) return 1.0;
  // At half the rate there is no sine beside the cosine, and the power scatters twice as much.
  const double step_hz = stepOf_hz(spectrum);
  const bool is_at_end = spectrum.frequencies_hz[bin] > 0.5 * spectrum.rate_hz - 1.5 * step_hz;
  const double series = is_at_end ? 0.5 * spectrum.series : spectrum.series;
  return std::min(1.0, static_cast<double>(spectrum.power.size()) / kPerResolution * chanceOf(ratio, series));
}

SpectralLine lineAt(const SampleSpectrum& spectrum, std::size_t bin, double frequency_hz, std::size_t readings,
                    double rho) {
  SpectralLine line;
  line.frequency_hz = frequency_hz;
  const double step_hz = stepOf_hz(spectrum);
  const double excess = spectrum.power[bin] - spectrum.background[bin];
  const double sds = excess / spectrum.background[bin] * std::sqrt(spectrum.series);
  line.error_hz = 0.5 * step_hz / std::sqrt(std::max(1.0, sds));
  line.p_value = chanceAt(spectrum, bin);
  // Before prewhitening the noise had variance 1 and the prewhitened 1 - rho^2.
  const double power = 4.0 * excess / static_cast<double>(readings) * (1.0 - rho * rho) /
                       prewhiteningGain(frequency_hz, spectrum.rate_hz, rho);
  line.amplitude_sd = std::sqrt(std::max(0.0, power));
  return line;
}

/// The strongest line not near one found before; none when nothing stands out. What stands out of its neighbourhood but
/// not of the noise elsewhere raises the background there.
std::optional<SpectralLine> strongestLine(SampleSpectrum& spectrum, const std::vector<Part>& white,
                                          const NoiseElsewhere& elsewhere, double rho) {
  const double step_hz = stepOf_hz(spectrum);
  std::vector<bool> refused(spectrum.power.size(), false);
  for (;;) {
    const std::size_t bin = highestBin(spectrum, refused);
    if (bin == spectrum.power.size()) return std::nullopt;
    if (chanceAt(spectrum, bin) > kLargestChance) return std::nullopt;
    const double frequency_hz =
        std::clamp(refined_hz(white, spectrum.frequencies_hz[bin], step_hz), 0.0, 0.5 * spectrum.rate_hz);
    spectrum.background[bin] = std::max(spectrum.background[bin], elsewhere.powerAt(frequency_hz));
    const SpectralLine line =
        lineAt(spectrum, bin, frequency_hz, static_cast<std::size_t>(white.front().values.rows()), rho);
    if (line.p_value <= kLargestChance) return line;
    refused[bin] = true;
  }
}

std::vector<double> frequencyGrid_hz(double rate_hz, std::size_t length) {
  const double step_hz = rate_hz / static_cast<double>(kPerResolution) / static_cast<double>(length);
  std::vector<double> frequencies_hz;
  for (int bin = kFirstBin; bin * step_hz <= 0.5 * rate_hz * (1.0 + 1e-9); ++bin)
    frequencies_hz.push_back(bin * step_hz);
  return frequencies_hz;
}

}  // namespace

std::optional<SampleSpectrum> sampleSpectrum(const std::vector<SampleVisit>& visits, const TableMetadata& metadata) {
  const std::optional<double> rate_hz = sampleRate_hz(visits, metadata);
  if (!rate_hz || *rate_hz <= 0.0) return std::nullopt;
  const std::vector<Part> parts = partsOf(visits, *rate_hz);
  if (parts.size() < kFewestStops) return std::nullopt;
  SampleSpectrum spectrum;
  spectrum.rate_hz = *rate_hz;
  spectrum.stops = visits.size();
  std::vector<double> readings;
  for (const SampleVisit& visit : visits) readings.push_back(static_cast<double>(visit.times_s.size()));
  spectrum.readings_per_stop = static_cast<std::size_t>(median(std::move(readings)));
  spectrum.series = independentSeries(parts);
  spectrum.frequencies_hz = frequencyGrid_hz(*rate_hz, medianLength(parts));
  const double rho = pooledCorrelation(parts);
  const std::vector<Part> white = prewhitened(parts, rho);
  spectrum.power = pooledPower(white, spectrum.frequencies_hz);
  spectrum.background = neighbourhood(spectrum.power);
  const NoiseElsewhere elsewhere(parts, white, spectrum, rho);
  while (spectrum.lines.size() < kMostLines) {
    const std::optional<SpectralLine> line = strongestLine(spectrum, white, elsewhere, rho);
    if (!line || (!spectrum.lines.empty() && line->amplitude_sd < 0.3 * spectrum.lines.front().amplitude_sd)) break;
    spectrum.lines.push_back(*line);
  }
  spectrum.correlation = spectrum.lines.empty() ? rho : pooledCorrelation(withoutLines(parts, spectrum.lines));
  const double n_values = spectrum.series * static_cast<double>(medianLength(parts));
  spectrum.correlation_sd = std::sqrt(std::max(1e-4, 1.0 - spectrum.correlation * spectrum.correlation) / n_values);
  return spectrum;
}

}  // namespace fieldtrue::recording
