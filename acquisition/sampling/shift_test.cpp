#include "acquisition/sampling/shift_test.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

namespace {

using Readings = std::span<const Eigen::Vector3d>;

/// Share of the largest squares left out of a variance, for steps and wild readings contaminate some.
constexpr double kTrimmedShare = 0.12;
/// Mean of the remaining squares over the mean of all: 0.77 for noise alike in all axes, less when one axis dominates.
constexpr double kTrimmedMean = 0.70;
constexpr double kMaxCorrelation = 0.95;
/// Of a straight line: four of them are left to scatter about it, and slow noise of a seventh of the time is one.
constexpr std::size_t kRunParts = 6;
/// In 3-D SDs of the parts: alike in all axes 1 in 9,000 runs of white noise is longer.
constexpr double kRunSigmas = 6.0;
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

Eigen::Vector3d medianOf(Readings values) {
  Eigen::Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> ordered = alongAxis(values, axis);
    const auto centre = ordered.begin() + static_cast<std::ptrdiff_t>(ordered.size() / 2);
    std::nth_element(ordered.begin(), centre, ordered.end());
    median[axis] = *centre;
  }
  return median;
}

std::vector<Eigen::Vector3d> differences(Readings values, std::size_t lag) {
  std::vector<Eigen::Vector3d> result;
  for (std::size_t i = lag; i < values.size(); ++i) result.push_back(values[i] - values[i - lag]);
  return result;
}

/// Half the mean squared difference of readings `lag` apart: variance * (1 - correlation at that lag). The median
/// difference is taken out first, so that a steady drift does not pass for correlated noise.
double halfSquaredDifference(Readings values, std::size_t lag) {
  if (values.size() <= lag) return 0.0;
  const std::vector<Eigen::Vector3d> all = differences(values, lag);
  const Eigen::Vector3d drift = medianOf(all);
  std::vector<double> squares;
  for (const Eigen::Vector3d& difference : all) squares.push_back((difference - drift).squaredNorm());
  return 0.5 * trimmedMeanSquare(std::move(squares));
}

/// Half the mean squared difference of successive differences: variance * (1 - r)(3 - r), and next to nothing for the
/// smooth path of a hand.
double halfSquaredBend(Readings values) {
  if (values.size() < 3) return 0.0;
  std::vector<double> squares;
  for (const Eigen::Vector3d& bend : differences(differences(values, 1), 1)) squares.push_back(bend.squaredNorm());
  return 0.5 * trimmedMeanSquare(std::move(squares));
}

struct Noise {
  double correlation = 0.0;
  double variance = 0.0;
};

/// What close neighbours tell of the noise. With D the half squared difference at a lag, D4/D1 = (1 + r)(1 + r^2) for a
/// first-order process; 1.5 standard errors are added to r, for too small a limit costs more than too wide a one.
Noise noiseFromNeighbours(Readings values) {
  Noise noise;
  const double lag1 = halfSquaredDifference(values, 1);
  if (lag1 <= 0.0) return noise;
  const double ratio = halfSquaredDifference(values, 4) / lag1;
  double low = 0.0, high = kMaxCorrelation;
  for (int step = 0; step < 30; ++step) {
    const double r = 0.5 * (low + high);
    ((1 + r) * (1 + r * r) < ratio ? low : high) = r;
  }
  const double error = (1.0 - 0.7 * low * low) / std::sqrt(static_cast<double>(values.size()));
  noise.correlation = std::min(low + 1.5 * error, kMaxCorrelation);
  const double innovation = std::min(lag1, halfSquaredBend(values) / (3.0 - noise.correlation));
  noise.variance = innovation / (1.0 - noise.correlation);
  return noise;
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
  const double variance = std::min(trimmedMeanSquare(std::move(squares)) / share_within, noise.variance);
  const double of_difference = mean_n + mean_m - 2.0 * covarianceOfMeans(noise.correlation, n, m);
  const double widened = sigmas * (1.0 + kFewReadings / (n + m));
  return {(after - before).norm(), widened * std::sqrt(std::max(variance * of_difference, 0.0))};
}

}  // namespace

Shift largestShift(Readings values, int block, double floor, double sigmas) {
  FT_CHECK(block >= 1 && floor > 0.0);
  const auto size = static_cast<std::size_t>(block);
  const Readings whole_blocks = values.first(values.size() / size * size);
  const Noise noise = noiseFromNeighbours(whole_blocks);
  Shift worst{0.0, floor};
  for (std::size_t split = size; split < whole_blocks.size(); split += size) {
    Shift shift = shiftAt(whole_blocks, split, noise, sigmas);
    shift.limit = std::max(shift.limit, floor);
    if (shift.size / shift.limit > worst.size / worst.limit) worst = shift;
  }
  return worst;
}

Shift steadyRun(Readings values, double floor) {
  FT_CHECK(floor > 0.0);
  Shift run{0.0, floor};
  if (values.size() < kRunParts) return run;
  const auto n = static_cast<double>(values.size());
  Eigen::Matrix<double, 1, kRunParts> times;
  Eigen::Matrix<double, 3, kRunParts> means;
  for (std::size_t part = 0; part < kRunParts; ++part) {
    const std::size_t first = part * values.size() / kRunParts, end = (part + 1) * values.size() / kRunParts;
    const auto column = static_cast<Eigen::Index>(part);
    times[column] = 0.5 * static_cast<double>(first + end - 1);
    means.col(column).setZero();
    for (std::size_t i = first; i < end; ++i) means.col(column) += values[i] / static_cast<double>(end - first);
  }
  times.array() -= times.mean();
  means.colwise() -= means.rowwise().mean().eval();
  const Eigen::Vector3d step = means * times.transpose() / times.squaredNorm();
  const double scatter = std::sqrt((means - step * times).squaredNorm() / (kRunParts - 2));
  run.size = step.norm() * (n - 1.0);
  run.limit = std::max(floor, kRunSigmas * scatter);
  return run;
}

}  // namespace fieldtrue::acquisition
