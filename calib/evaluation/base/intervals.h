#pragma once

#include <cstddef>
#include <span>

namespace fieldtrue::evaluation {

/// How sure the RMS of held-out errors is, as a figure for this fitted correction at fresh places drawn like those held
/// out. Errors of a correction are heavy-tailed: a few places at the edge carry the mean square, and a bootstrap over
/// places cannot draw a tail that the table does not hold. So the interval is one of Student's t on the logarithm of
/// the mean square, with the degrees of freedom that the concentration of the squares leaves:
///
///   m   = places, those at one true position counted once, less the coefficients of the fit
///   c   = SD of the squares / their mean        n_e = m / (1 + c^2), the places that carry the mean square
///   t   = 95 % point of Student's t with max(1, n_e / 2) degrees of freedom
///   log mean square: from -t c/sqrt(m) to +t c/sqrt(m) (1 + 1.2/sqrt(n_e))
///
/// c/sqrt(m) is widened by 1.3 for a tuned method, whose choices vary with the places too. Where it is known by how
/// much the fit itself varies (`own_variance`), either end is at least 1.645 sqrt(c^2/m + own_variance) away. What it
/// covers: tests/studies/interval_coverage.py.
/// @source effective number: Kish 1965, section 11.7; logarithm by the delta method; 1.2 and 1.3 from the study
struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// 95 % point of Student's t, of at least one degree of freedom.
double studentPoint95(double degrees);

double rootMeanSquare(std::span<const double> values);

/// What a fit took from the places at which it is judged by leaving them out. The errors of places that a sum of few
/// terms was fitted to depend on each other, and tell less of fresh ones.
struct FitFreedom {
  double coefficients_a_place = 0.0;  ///< Coefficients an axis over places fitted; at most 1. @see PositionModel
  bool is_tuned = false;              ///< @see CorrectionMethod::tunes
  double positions_a_place = 1.0;     ///< Below 1 where places of several sensors share true positions.
  double own_variance = 0.0;          ///< @see HoldOutFits::ownVariance
};

/// 90 % interval of the RMS of places' errors; not a number for one place, which tells nothing of others.
Interval rmsInterval90(std::span<const double> errors, const FitFreedom& freedom = {});

/// What a correction gains on places its fits did not see: 1 - RMS after / RMS before, with its paired 90 % interval.
/// With u = after^2 / mean(after^2) - before^2 / mean(before^2), c = SD of u, m, n_e and t as above: the ratio of mean
/// squares is at least that seen times exp(-t c / sqrt(m) (1 + 1.2/sqrt(n_e))). It is at most the largest r for which
/// mean(after^2 - r before^2) lies within T of zero, in its SDs, where T is 1.75 times the 95 % point of Student's t of
/// m - 1 degrees, and no more than that seen times exp(T c / sqrt(m)): Fieller's r grows without bound where few places
/// carry the error before. c is widened by 1.3 for a tuned method, and for Fieller's r T is; what the fit's own
/// variance asks for is as above. Of one place the ends are not numbers.
/// @source Fieller 1954 for the second
struct PairedGain {
  double gain = 0.0;
  double low90 = 0.0;
  double high90 = 0.0;
};

/// @param before, after errors of the same places, same order and unit
PairedGain pairedGain(std::span<const double> before, std::span<const double> after, const FitFreedom& freedom = {});

/// RMS of one method minus that of another on the same places, with its paired 90 % interval: of n places whatever was
/// fitted, t (1 + 1.4/sqrt(n_e)) SDs to either side.
struct PairedDifference {
  double difference = 0.0;
  double low90 = 0.0;
  double high90 = 0.0;
};

/// @param errors, of_best of the same places, same order and unit; of one place the ends are not numbers
PairedDifference pairedDifference(std::span<const double> errors, std::span<const double> of_best,
                                  double positions_a_place = 1.0);

/// The place whose removal lowers the gain most.
std::size_t worstPlace(std::span<const double> before, std::span<const double> after);

}  // namespace fieldtrue::evaluation
