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

/// Widening of a tuned method.
constexpr double kTuned = 1.3;
/// Of the end at which a gain is least, against Student's t of the free places: it is that of the best of many methods.
constexpr double kLeastGain = 1.75;
/// How much farther than t the upper end of a mean square lies, and both ends of a difference, in 1/sqrt(n_e).
constexpr double kAbove = 1.2;
constexpr double kAround = 1.4;
/// 95 % point of the normal distribution.
constexpr double kNormalPoint95 = 1.645;

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

/// How far a mean over places may be off: in SDs of the mean.
struct Reach {
  double t = 0.0;
  double n_carrying = 0.0;

  double beyond(double share) const { return t * (1.0 + share / std::sqrt(n_carrying)); }
};

/// True positions less the coefficients of the fit.
double freePlaces(std::size_t n_places, const FitFreedom& freedom) {
  return std::max(1.0, static_cast<double>(n_places) * (freedom.positions_a_place - freedom.coefficients_a_place));
}

/// @param relative what each place contributes, in units of the mean square
Reach reach90(std::span<const double> relative, const FitFreedom& freedom) {
  const double n_carrying = freePlaces(relative.size(), freedom) / (1.0 + sampleVariance(relative));
  return {studentPoint95(0.5 * n_carrying), n_carrying};
}

double sdOfMean(std::span<const double> values, const FitFreedom& freedom) {
  const double widening = freedom.is_tuned ? kTuned : 1.0;
  return widening * std::sqrt(sampleVariance(values) / freePlaces(values.size(), freedom));
}

/// How far the logarithm of a mean square may be off at least, where the fit itself varies.
/// @param sd of the logarithm, from how the places differ
double ownReach(double sd, const FitFreedom& freedom) {
  return freedom.own_variance > 0.0 ? kNormalPoint95 * std::sqrt(sd * sd + freedom.own_variance) : 0.0;
}

double covariance(std::span<const double> a, std::span<const double> b) {
  std::vector<double> sum(a.size());
  std::transform(a.begin(), a.end(), b.begin(), sum.begin(), std::plus<>());
  return 0.5 * (sampleVariance(sum) - sampleVariance(a) - sampleVariance(b));
}

/// The largest ratio r of two means, both 1 as seen, for which mean(a - r b) lies within `reach` SDs of a single place
/// of zero; none where the mean of b does.
/// @source Fieller 1954
std::optional<double> fiellerRatio(std::span<const double> a, std::span<const double> b, double reach) {
  const double scale = reach * reach;
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

Interval rmsInterval90(std::span<const double> errors, const FitFreedom& freedom) {
  FT_CHECK(!errors.empty());
  if (errors.size() < 2) return {std::nan(""), std::nan("")};
  const double rms = rootMeanSquare(errors);
  const std::vector<double> relative = relativeSquares(errors);
  const double sd = sdOfMean(relative, freedom);
  const Reach reach = reach90(relative, freedom);
  const double least = ownReach(sd, freedom);
  return {rms * std::exp(-0.5 * std::max(reach.t * sd, least)),
          rms * std::exp(0.5 * std::max(reach.beyond(kAbove) * sd, least))};
}

PairedGain pairedGain(std::span<const double> before, std::span<const double> after, const FitFreedom& freedom) {
  FT_CHECK(before.size() == after.size() && !before.empty());
  const double gain = gainOf(sumOfSquares(before), sumOfSquares(after));
  if (before.size() < 2) return {gain, std::nan(""), std::nan("")};
  const std::vector<double> of_before = relativeSquares(before), of_after = relativeSquares(after);
  const std::vector<double> relative = differences(of_after, of_before);
  const double sd = sdOfMean(relative, freedom);
  const double n_free = freePlaces(before.size(), freedom);
  const double reach = kLeastGain * studentPoint95(n_free - 1.0);
  const double in_places = reach * (freedom.is_tuned ? kTuned : 1.0) / std::sqrt(n_free);
  const double own = ownReach(sd, freedom);
  const double most = std::max(
      std::min(fiellerRatio(of_after, of_before, in_places).value_or(HUGE_VAL), std::exp(reach * sd)), std::exp(own));
  const double least = std::exp(-std::max(reach90(relative, freedom).beyond(kAbove) * sd, own));
  return {gain, 1.0 - (1.0 - gain) * std::sqrt(most), 1.0 - (1.0 - gain) * std::sqrt(least)};
}

PairedDifference pairedDifference(std::span<const double> errors, std::span<const double> of_best,
                                  double positions_a_place) {
  FT_CHECK(errors.size() == of_best.size() && !errors.empty());
  const double rms = rootMeanSquare(errors), best_rms = rootMeanSquare(of_best);
  if (errors.size() < 2) return {rms - best_rms, std::nan(""), std::nan("")};
  const FitFreedom freedom{.positions_a_place = positions_a_place};
  std::vector<double> relative = relativeSquares(errors);
  std::vector<double> best_relative = relativeSquares(of_best);
  const Reach reach = reach90(differences(relative, best_relative), freedom);
  // d RMS = RMS/2 d log(mean square).
  for (double& value : relative) value *= 0.5 * rms;
  for (double& value : best_relative) value *= 0.5 * best_rms;
  const double half = reach.beyond(kAround) * sdOfMean(differences(relative, best_relative), freedom);
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
