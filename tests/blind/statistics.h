#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace blind {

/// A figure with its 95 % interval and the number of sessions or values behind it; NaN where nothing was counted.
struct Interval {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
  std::size_t count = 0;
};

/// A stated probability and whether what it was stated of turned out right.
struct Forecast {
  double probability = 0.0;
  bool is_right = false;
};

using Statistic = std::function<double(std::span<const double>)>;

/// Share of hits with its Wilson score interval.
/// @param hits how many of `count` succeeded
/// @source Wilson 1927, J. Am. Stat. Assoc. 22, 209; two-sided 95 %, no continuity correction
Interval wilson(std::size_t hits, std::size_t count);

/// Quantile by linear interpolation between order statistics (Hyndman and Fan 1996, type 7); NaN of nothing.
/// @param share 0..1
double quantileOf(std::span<const double> values, double share);
double meanOf(std::span<const double> values);

/// A statistic with the 2.5 % and 97.5 % quantiles of its value over 2,000 resamples; the seed is fixed.
/// @source Efron and Tibshirani 1993, An Introduction to the Bootstrap, chapter 13, percentile interval
Interval bootstrap(std::span<const double> values, const Statistic& statistic);

/// How many of several things of one session hold, which is one draw: they do not vary independently.
struct Tally {
  double hits = 0.0;
  double count = 0.0;
};

/// Share of hits over all sessions, bootstrapped by session.
/// @return count is that of things, not of sessions
Interval pooledShare(std::span<const Tally> sessions);

/// Sum of the hits over the sum of the counts, bootstrapped by session; counts may be any number.
/// @return count is that of sessions
Interval ratioOfSums(std::span<const Tally> sessions);

/// Mean squared difference between the stated probability and what happened (Brier 1950), bootstrapped.
Interval brierScore(std::span<const Forecast> forecasts);

/// Mean distance between stated probability and share of right ones over ten equal bins, weighted by their counts.
/// @source Naeini, Cooper and Hauskrecht 2015, Obtaining Well Calibrated Probabilities Using Bayesian Binning
double expectedCalibrationError(std::span<const Forecast> forecasts);
Interval calibrationError(std::span<const Forecast> forecasts);

}  // namespace blind
