#include "acquisition/session/motion.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue {

namespace {

using Readings = std::span<const Eigen::Vector3d>;

/// Share of the largest squares left out of a variance, for steps and wild readings contaminate some.
constexpr double kTrimmedShare = 0.12;
/// Mean of the remaining squares over the mean of all: 0.77 for noise alike in all axes, less when one axis dominates.
constexpr double kTrimmedMean = 0.70;
constexpr double kMaxCorrelation = 0.95;
/// Widening of the limit for n readings is 1 + kFewReadings / n.
constexpr double kFewReadings = 10.0;

double trimmedMeanSquare(std::vector<double> squares) {
  std::sort(squares.begin(), squares.end());
  const auto kept = std::max<std::size_t>(
      1, static_cast<std::size_t>(std::floor(static_cast<double>(squares.size()) * (1.0 - kTrimmedShare))));
  double sum = 0.0;
  for (std::size_t i = 0; i < kept; ++i) sum += squares[i];
  return sum / static_cast<double>(kept) / kTrimmedMean;
}

std::vector<double> alongAxis(Readings values, int axis) {
  std::vector<double> result(values.size());
  std::transform(values.begin(), values.end(), result.begin(), [axis](const auto& value) { return value[axis]; });
  return result;
}

/// Half the mean squared difference of readings `lag` apart: variance * (1 - correlation at that lag). The median
/// difference is taken out first, so that a steady drift does not pass for correlated noise.
double halfSquaredDifference(Readings values, std::size_t lag) {
  if (values.size() <= lag) return 0.0;
  std::vector<Eigen::Vector3d> differences;
  for (std::size_t i = lag; i < values.size(); ++i) differences.push_back(values[i] - values[i - lag]);
  Eigen::Vector3d drift;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> ordered = alongAxis(differences, axis);
    const auto centre = ordered.begin() + static_cast<std::ptrdiff_t>(ordered.size() / 2);
    std::nth_element(ordered.begin(), centre, ordered.end());
    drift[axis] = *centre;
  }
  std::vector<double> squares;
  for (const Eigen::Vector3d& difference : differences) squares.push_back((difference - drift).squaredNorm());
  return 0.5 * trimmedMeanSquare(std::move(squares));
}

/// Upper estimate of the lag-1 correlation. With D the half squared difference at a lag, D2/D1 = 1 + r and
/// D4/D1 = (1 + r)(1 + r^2) for a first-order process; the larger answer plus one standard error is taken.
double upperCorrelation(Readings values, double half_square_lag1) {
  if (half_square_lag1 <= 0.0) return 0.0;
  const double from_lag2 = halfSquaredDifference(values, 2) / half_square_lag1 - 1.0;
  const double ratio4 = halfSquaredDifference(values, 4) / half_square_lag1;
  double low = 0.0, high = kMaxCorrelation;
  for (int step = 0; step < 30; ++step) {
    const double r = 0.5 * (low + high);
    ((1 + r) * (1 + r * r) < ratio4 ? low : high) = r;
  }
  const double estimate = std::clamp(std::max(from_lag2, low), 0.0, kMaxCorrelation);
  const double error = (1.0 - 0.7 * estimate * estimate) / std::sqrt(static_cast<double>(values.size()));
  return std::min(estimate + error, kMaxCorrelation);
}

Eigen::Vector3d centreOf(Readings values) {
  Eigen::Vector3d centre;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> ordered = alongAxis(values, axis);
    std::sort(ordered.begin(), ordered.end());
    const std::size_t cut = ordered.size() / 5;
    double sum = 0.0;
    for (std::size_t i = cut; i < ordered.size() - cut; ++i) sum += ordered[i];
    centre[axis] = sum / static_cast<double>(ordered.size() - 2 * cut);
  }
  return centre;
}

/// Variance of the mean of n successive readings of correlation r, in variances of one reading.
double varianceOfMean(double r, double n) {
  return ((1 + r) / (1 - r) - 2 * r * (1 - std::pow(r, n)) / (n * (1 - r) * (1 - r))) / n;
}

/// Covariance of the means of n readings and of the m that follow, in variances of one reading.
double covarianceOfMeans(double r, double n, double m) {
  return r * (1 - std::pow(r, n)) * (1 - std::pow(r, m)) / ((1 - r) * (1 - r) * n * m);
}

struct Noise {
  double correlation = 0.0;
  double variance_from_neighbours = 0.0;
};

Shift shiftAt(Readings values, std::size_t split, const Noise& noise, double sigmas) {
  const Eigen::Vector3d before = centreOf(values.first(split));
  const Eigen::Vector3d after = centreOf(values.subspan(split));
  std::vector<double> squares;
  for (std::size_t i = 0; i < values.size(); ++i) {
    squares.push_back((values[i] - (i < split ? before : after)).squaredNorm());
  }
  const auto n = static_cast<double>(split), m = static_cast<double>(values.size() - split);
  const double mean_n = varianceOfMean(noise.correlation, n), mean_m = varianceOfMean(noise.correlation, m);
  const double share_within = std::max(1.0 - (n * mean_n + m * mean_m) / (n + m), 0.02);
  const double variance =
      std::min(trimmedMeanSquare(std::move(squares)) / share_within, noise.variance_from_neighbours);
  const double of_difference = mean_n + mean_m - 2.0 * covarianceOfMeans(noise.correlation, n, m);
  const double widened = sigmas * (1.0 + kFewReadings / (n + m));
  return {(after - before).norm(), widened * std::sqrt(std::max(variance * of_difference, 0.0))};
}

}  // namespace

Shift largestShift(Readings values, int block, double floor, double sigmas) {
  FT_CHECK(block >= 1 && floor > 0.0);
  const auto size = static_cast<std::size_t>(block);
  const Readings whole_blocks = values.first(values.size() / size * size);
  const double half_square_lag1 = halfSquaredDifference(whole_blocks, 1);
  Noise noise;
  noise.correlation = upperCorrelation(whole_blocks, half_square_lag1);
  noise.variance_from_neighbours = half_square_lag1 / (1.0 - noise.correlation);
  Shift worst{0.0, floor};
  for (std::size_t split = size; split < whole_blocks.size(); split += size) {
    Shift shift = shiftAt(whole_blocks, split, noise, sigmas);
    shift.limit = std::max(shift.limit, floor);
    if (shift.size / shift.limit > worst.size / worst.limit) worst = shift;
  }
  return worst;
}

}  // namespace fieldtrue
