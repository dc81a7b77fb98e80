#include "calib/core/quantum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/core/statistics.h"

namespace fieldtrue {

namespace {

constexpr std::size_t kFewestValues = 20;
constexpr std::size_t kFewestDistinct = 4;
constexpr double kFinestLattice_m = 1e-6;
/// Chance that values off any lattice would fit the one found.
constexpr double kLargestChance = 1e-6;
constexpr int kDecimals = 9;
constexpr double kInch_m = 0.0254;

std::vector<double> sortedFinite(std::span<const double> values) {
  std::vector<double> sorted;
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
               [](double value) { return std::isfinite(value) && !isMissingMark(value); });
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

/// Drops values that differ from the one before by rounding only.
std::vector<double> distinctValues(const std::vector<double>& sorted, double same) {
  std::vector<double> distinct;
  for (const double value : sorted) {
    if (distinct.empty() || value - distinct.back() > same) distinct.push_back(value);
  }
  return distinct;
}

bool areMultiples(std::span<const double> values, double step) {
  return std::all_of(values.begin(), values.end(), [&](double value) {
    const double steps = value / step;
    return std::abs(steps - std::round(steps)) < 1e-5;
  });
}

/// The lattice of values that are whole numbers of printed steps; none when it is the printed step itself.
std::optional<double> wholeLattice_m(const std::vector<double>& distinct_m, double step_m) {
  std::int64_t divisor = 0;
  for (const double value_m : distinct_m) {
    divisor = std::gcd(divisor, static_cast<std::int64_t>(std::llround((value_m - distinct_m.front()) / step_m)));
  }
  const double chance = std::pow(static_cast<double>(divisor), -static_cast<double>(distinct_m.size() - 1));
  if (divisor < 2 || chance > kLargestChance) return std::nullopt;
  return static_cast<double>(divisor) * step_m;
}

/// How one candidate spacing fits the gaps between neighbouring values.
struct LatticeTrial {
  bool fits = false;
  double spacing_m = 0.0;        ///< Refined by least squares over the gaps.
  double log_chance = 0.0;       ///< Of gaps off any lattice fitting as well.
  double misfit_m = 0.0;         ///< Of the first gap that is no multiple.
  double spacing_error_m = 0.0;  ///< Largest error of the spacing where the trial ended.
};

/// @param gaps_m ascending
/// @param gap_error_m largest error of a gap
LatticeTrial tryLattice(const std::vector<double>& gaps_m, double spacing_m, double spacing_error_m,
                        double gap_error_m) {
  LatticeTrial trial{true, spacing_m, 0.0, 0.0, spacing_error_m};
  double sum_kt = 0.0;
  double sum_kk = 0.0;
  bool is_first = true;
  for (const double gap_m : gaps_m) {
    const double k = std::round(gap_m / trial.spacing_m);
    const double allowed_m = gap_error_m + k * trial.spacing_error_m;
    // Wider gaps cannot be counted in steps any more.
    if (allowed_m > trial.spacing_m / 4.0) break;
    const double misfit_m = std::abs(gap_m - k * trial.spacing_m);
    if (misfit_m > allowed_m) {
      trial.fits = false;
      trial.misfit_m = misfit_m;
      trial.spacing_error_m = allowed_m;
      return trial;
    }
    if (!is_first) trial.log_chance += std::log(2.0 * allowed_m / trial.spacing_m);
    is_first = false;
    sum_kt += k * gap_m;
    sum_kk += k * k;
    trial.spacing_m = sum_kt / sum_kk;
    trial.spacing_error_m = gap_error_m / std::sqrt(sum_kk);
  }
  return trial;
}

/// Euclid's algorithm on gaps known only to within an error: the remainder that does not fit is the next candidate.
std::optional<double> approximateLattice_m(const std::vector<double>& distinct_m, double gap_error_m) {
  std::vector<double> gaps_m;
  for (std::size_t i = 1; i < distinct_m.size(); ++i) gaps_m.push_back(distinct_m[i] - distinct_m[i - 1]);
  std::sort(gaps_m.begin(), gaps_m.end());
  double spacing_m = gaps_m.front();
  double spacing_error_m = gap_error_m;
  while (spacing_m >= std::max(kFinestLattice_m, 6.0 * gap_error_m)) {
    const LatticeTrial trial = tryLattice(gaps_m, spacing_m, spacing_error_m, gap_error_m);
    if (trial.fits) {
      return trial.log_chance < std::log(kLargestChance) ? std::optional(trial.spacing_m) : std::nullopt;
    }
    spacing_m = trial.misfit_m;
    spacing_error_m = trial.spacing_error_m;
  }
  return std::nullopt;
}

}  // namespace

double printedStep_m(std::span<const double> values_m) {
  for (const double unit_m : {1.0, kInch_m}) {
    for (int decimals = 0; decimals <= kDecimals; ++decimals) {
      const double step_m = unit_m / std::pow(10.0, decimals);
      if (areMultiples(values_m, step_m)) return step_m;
    }
  }
  return 0.0;
}

std::optional<double> findQuantum_m(std::span<const double> values_m) {
  const std::vector<double> sorted_m = sortedFinite(values_m);
  if (sorted_m.size() < kFewestValues) return std::nullopt;
  const double rounding_m =
      4.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(sorted_m.front()), std::abs(sorted_m.back()));
  const std::vector<double> distinct_m = distinctValues(sorted_m, 2.0 * rounding_m);
  if (distinct_m.size() < kFewestDistinct) return std::nullopt;
  const double step_m = printedStep_m(distinct_m);
  if (step_m > 0.0) {
    const std::optional<double> whole_m = wholeLattice_m(distinct_m, step_m);
    if (whole_m && *whole_m >= kFinestLattice_m) return whole_m;
  }
  return approximateLattice_m(distinct_m, std::max(step_m, rounding_m));
}

}  // namespace fieldtrue
