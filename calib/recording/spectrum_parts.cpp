#include "calib/recording/spectrum_parts.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/statistics.h"
#include "calib/recording/relaxation_noise.h"

namespace fieldtrue::recording {

namespace {

constexpr std::size_t kFewestSpectrumReadings = 16;
constexpr std::size_t kMostStops = 1500;
constexpr std::size_t kLongestPart = 128;
constexpr double kStandsStill = 1e-12;

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

/// Power of every channel at every frequency, 1 for white noise.
Eigen::MatrixXd partPower(const Part& part, const std::vector<double>& frequencies_hz) {
  const Eigen::Index n = part.values.rows();
  Eigen::MatrixXd cosines(static_cast<Eigen::Index>(frequencies_hz.size()), n);
  Eigen::MatrixXd sines = cosines;
  for (Eigen::Index f = 0; f < cosines.rows(); ++f) {
    const double omega = 2.0 * std::numbers::pi * frequencies_hz[static_cast<std::size_t>(f)];
    cosines.row(f) = (omega * part.times_s.transpose().array()).cos();
    sines.row(f) = (omega * part.times_s.transpose().array()).sin();
  }
  return ((cosines * part.values).array().square() + (sines * part.values).array().square()) / static_cast<double>(n);
}

}  // namespace

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

double independentSeries(const std::vector<Part>& parts) {
  double series = 0.0;
  for (const Part& part : parts) {
    const Eigen::MatrixXd correlation = part.values.transpose() * part.values / static_cast<double>(part.values.rows());
    const double channels = correlation.trace();
    series += channels * channels / correlation.squaredNorm();
  }
  return series;
}

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

std::vector<Part> withoutSinusoid(std::vector<Part> parts, double frequency_hz) {
  for (Part& part : parts) {
    Eigen::MatrixXd basis(part.values.rows(), 2);
    basis.col(0) = (2.0 * std::numbers::pi * frequency_hz * part.times_s.array()).cos();
    basis.col(1) = (2.0 * std::numbers::pi * frequency_hz * part.times_s.array()).sin();
    part.values -= basis * basis.colPivHouseholderQr().solve(part.values);
  }
  return parts;
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

}  // namespace fieldtrue::recording
