#include "calib/evaluation/base/intervals.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::evaluation {
namespace {

/// Widenings of the two sides, in 1/sqrt(n_e), and of a tuned method.
constexpr double kBelow = 0.4;
constexpr double kAbove = 1.4;
constexpr double kTuned = 1.3;
/// Of the end at which a gain is least, against Student's t of all places: it is that of the best of many methods.
constexpr double kLeastGain = 1.75;

double sumOfSquares(std::span<const double> values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

double gainOf(double before_squares, double after_squares) {
  return before_squares > 0.0 ? 1.0 - std::sqrt(std::max(0.0, after_squares) / before_squares) : 0.0;
}

/// Each value's square over the mean of the squares.
std::vector<double> relativeSquares(std::span<const double> values) {
  const double mean = sumOfSquares(values) / static_cast<double>(values.size());
  std::vector<double> relative(values.size(), 0.0);
  if (mean > 0.0)
    std::transform(values.begin(), values.end(), relative.begin(), [&](double value) { return value * value / mean; });
  return relative;
}

std::vector<double> differences(std::span<const double> a, std::span<const double> b) {
  std::vector<double> difference(a.size());
  std::transform(a.begin(), a.end(), b.begin(), difference.begin(), std::minus<>());
  return difference;
}

double sampleVariance(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  if (values.size() < 2) return 0.0;
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return squares / (n - 1.0);
}

}  // namespace

double studentPoint95(double degrees) {
  return boost::math::quantile(boost::math::students_t(std::max(1.0, degrees)), 0.95);
}

namespace {

/// How far a mean over places may be off: in SDs of the mean, to either side.
struct Reach {
  double below = 0.0;
  double above = 0.0;
};

/// @param relative what each place contributes, in units of the mean square
Reach reach90(std::span<const double> relative) {
  const double n_carrying = static_cast<double>(relative.size()) / (1.0 + sampleVariance(relative));
  const double t = studentPoint95(0.5 * n_carrying);
  return {t * (1.0 + kBelow / std::sqrt(n_carrying)), t * (1.0 + kAbove / std::sqrt(n_carrying))};
}

double sdOfMean(std::span<const double> values) {
  return std::sqrt(sampleVariance(values) / static_cast<double>(values.size()));
}

double covariance(std::span<const double> a, std::span<const double> b) {
  std::vector<double> sum(a.size());
  std::transform(a.begin(), a.end(), b.begin(), sum.begin(), std::plus<>());
  return 0.5 * (sampleVariance(sum) - sampleVariance(a) - sampleVariance(b));
}

/// The largest ratio r of two means, both 1 as seen, for which mean(a - r b) lies within `reach` SDs of zero; none
/// where the mean of b does.
/// @source Fieller 1954
std::optional<double> fiellerRatio(std::span<const double> a, std::span<const double> b, double reach) {
  const double scale = reach * reach / static_cast<double>(a.size());
  const std::vector<double> difference = differences(a, b);
  // With e = r - 1: e^2 = scale (var(a - b) - 2 e cov(a - b, b) + e^2 var b).
  const double square = 1.0 - scale * sampleVariance(b);
  const double half_linear = scale * covariance(difference, b);
  if (!(square > 0.0)) return std::nullopt;
  const double root = std::sqrt(half_linear * half_linear + square * scale * sampleVariance(difference));
  return 1.0 + (root - half_linear) / square;
}

}  // namespace

double rootMeanSquare(std::span<const double> values) {
  return values.empty() ? 0.0 : std::sqrt(sumOfSquares(values) / static_cast<double>(values.size()));
}

Interval rmsInterval90(std::span<const double> errors, bool is_tuned) {
  FT_CHECK(!errors.empty());
  if (errors.size() < 2) return {std::nan(""), std::nan("")};
  const double rms = rootMeanSquare(errors);
  const std::vector<double> relative = relativeSquares(errors);
  const double sd = sdOfMean(relative) * (is_tuned ? kTuned : 1.0);
  const Reach reach = reach90(relative);
  return {rms * std::exp(-0.5 * reach.below * sd), rms * std::exp(0.5 * reach.above * sd)};
}

PairedGain pairedGain(std::span<const double> before, std::span<const double> after, bool is_tuned) {
  FT_CHECK(before.size() == after.size() && !before.empty());
  const double gain = gainOf(sumOfSquares(before), sumOfSquares(after));
  const std::vector<double> of_before = relativeSquares(before), of_after = relativeSquares(after);
  const std::vector<double> relative = differences(of_after, of_before);
  const double sd = sdOfMean(relative) * (is_tuned ? kTuned : 1.0);
  const double reach =
      kLeastGain * (is_tuned ? kTuned : 1.0) * studentPoint95(static_cast<double>(before.size()) - 1.0);
  const double most = fiellerRatio(of_after, of_before, reach).value_or(std::exp(reach * sd));
  const double least = std::exp(-reach90(relative).above * sd);
  return {gain, 1.0 - (1.0 - gain) * std::sqrt(most), 1.0 - (1.0 - gain) * std::sqrt(least)};
}

PairedDifference pairedDifference(std::span<const double> errors, std::span<const double> of_best) {
  FT_CHECK(errors.size() == of_best.size() && !errors.empty());
  const double rms = rootMeanSquare(errors), best_rms = rootMeanSquare(of_best);
  std::vector<double> relative = relativeSquares(errors);
  std::vector<double> best_relative = relativeSquares(of_best);
  const Reach reach = reach90(differences(relative, best_relative));
  // d RMS = RMS/2 d log(mean square).
  for (double& value : relative) value *= 0.5 * rms;
  for (double& value : best_relative) value *= 0.5 * best_rms;
  const double half = reach.above * sdOfMean(differences(relative, best_relative));
  return {rms - best_rms, rms - best_rms - half, rms - best_rms + half};
}

std::size_t worstPlace(std::span<const double> before, std::span<const double> after) {
  FT_CHECK(before.size() == after.size() && !before.empty());
  const double before_squares = sumOfSquares(before);
  const double after_squares = sumOfSquares(after);
  std::size_t worst = 0;
  double lowest_gain = HUGE_VAL;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double gain = gainOf(before_squares - before[i] * before[i], after_squares - after[i] * after[i]);
    if (gain < lowest_gain) {
      lowest_gain = gain;
      worst = i;
    }
  }
  return worst;
}

}  // namespace fieldtrue::evaluation
