#include "calib/recording/sample_spectrum.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/statistics.h"
#include "calib/recording/noise_elsewhere.h"

namespace fieldtrue::recording {

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr std::size_t kFewestStops = 4;
constexpr int kNearest = 3;  ///< Neighbour of a frequency, in bins to either side.
constexpr std::size_t kMostLines = 3;

double stepOf_hz(const SampleSpectrum& spectrum) { return spectrum.frequencies_hz[1] - spectrum.frequencies_hz[0]; }

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
double leastExcess(std::size_t bin, const LineRules& rules) {
  constexpr int kLowest = 4 * kPerResolution - kFirstBin;  // Below 4 periods a part.
  if (bin < kLowest) return rules.least_lowest_excess;
  return bin < kFarthest ? rules.least_low_excess : rules.least_excess;
}

/// That power stands out of its background as much by chance at any of the frequencies.
double chanceAt(const SampleSpectrum& spectrum, std::size_t bin, const LineRules& rules) {
  const double ratio = spectrum.power[bin] / spectrum.background[bin];
  if (ratio < 1.0 + leastExcess(bin, rules)) return 1.0;
  // At half the rate there is no sine beside the cosine, and the power scatters twice as much.
  const double step_hz = stepOf_hz(spectrum);
  const bool is_at_end = spectrum.frequencies_hz[bin] > 0.5 * spectrum.rate_hz - 1.5 * step_hz;
  const double series = is_at_end ? 0.5 * spectrum.series : spectrum.series;
  return std::min(1.0, static_cast<double>(spectrum.power.size()) / kPerResolution * chanceOf(ratio, series));
}

SpectralLine lineAt(const SampleSpectrum& spectrum, std::size_t bin, double frequency_hz, std::size_t readings,
                    double rho, const LineRules& rules) {
  SpectralLine line;
  line.frequency_hz = frequency_hz;
  const double step_hz = stepOf_hz(spectrum);
  const double excess = spectrum.power[bin] - spectrum.background[bin];
  const double sds = excess / spectrum.background[bin] * std::sqrt(spectrum.series);
  line.error_hz = 0.5 * step_hz / std::sqrt(std::max(1.0, sds));
  line.p_value = chanceAt(spectrum, bin, rules);
  // Before prewhitening the noise had variance 1 and the prewhitened 1 - rho^2.
  const double power = 4.0 * excess / static_cast<double>(readings) * (1.0 - rho * rho) /
                       prewhiteningGain(frequency_hz, spectrum.rate_hz, rho);
  line.amplitude_sd = std::sqrt(std::max(0.0, power));
  return line;
}

/// The strongest line not near one found before; none when nothing stands out. What stands out of its neighbourhood but
/// not of the noise elsewhere raises the background there.
std::optional<SpectralLine> strongestLine(SampleSpectrum& spectrum, const std::vector<Part>& white,
                                          const NoiseElsewhere& elsewhere, double rho, const LineRules& rules) {
  const double step_hz = stepOf_hz(spectrum);
  std::vector<bool> refused(spectrum.power.size(), false);
  for (;;) {
    const std::size_t bin = highestBin(spectrum, refused);
    if (bin == spectrum.power.size()) return std::nullopt;
    if (chanceAt(spectrum, bin, rules) > rules.largest_chance) return std::nullopt;
    const double frequency_hz =
        std::clamp(refined_hz(white, spectrum.frequencies_hz[bin], step_hz), 0.0, 0.5 * spectrum.rate_hz);
    spectrum.background[bin] = std::max(spectrum.background[bin], elsewhere.powerAt(frequency_hz));
    const SpectralLine line =
        lineAt(spectrum, bin, frequency_hz, static_cast<std::size_t>(white.front().values.rows()), rho, rules);
    if (line.p_value <= rules.largest_chance) return line;
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

std::optional<SampleSpectrum> sampleSpectrum(const std::vector<SampleVisit>& visits, const TableMetadata& metadata,
                                             const LineRules& rules) {
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
  const NoiseElsewhere elsewhere(parts, white, *rate_hz, stepOf_hz(spectrum), spectrum.series, rho);
  while (spectrum.lines.size() < kMostLines) {
    const std::optional<SpectralLine> line = strongestLine(spectrum, white, elsewhere, rho, rules);
    if (!line || (!spectrum.lines.empty() && line->amplitude_sd < 0.3 * spectrum.lines.front().amplitude_sd)) break;
    spectrum.lines.push_back(*line);
  }
  if (spectrum.lines.empty()) {
    spectrum.correlation = rho;
  } else {
    std::vector<Part> left = parts;
    for (const SpectralLine& line : spectrum.lines) left = withoutSinusoid(std::move(left), line.frequency_hz);
    spectrum.correlation = pooledCorrelation(left);
  }
  const double n_values = spectrum.series * static_cast<double>(medianLength(parts));
  spectrum.correlation_sd = std::sqrt(std::max(1e-4, 1.0 - spectrum.correlation * spectrum.correlation) / n_values);
  return spectrum;
}

}  // namespace fieldtrue::recording
