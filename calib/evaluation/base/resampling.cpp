#include "calib/evaluation/base/resampling.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/error.h"
#include "calib/core/statistics.h"

namespace fieldtrue::evaluation {
namespace {

constexpr std::size_t kResamples = 2000;

double gainOf(double before_squares, double after_squares) {
  return before_squares > 0.0 ? 1.0 - std::sqrt(std::max(0.0, after_squares) / before_squares) : 0.0;
}

}  // namespace

std::size_t IndexSource::below(std::size_t count) {
  // SplitMix64 (Steele, Lea, Flood 2014), scaled by the high half.
  state_ += 0x9e3779b97f4a7c15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return static_cast<std::size_t>(((z >> 32) * static_cast<std::uint64_t>(count)) >> 32);
}

Interval bootstrapInterval90(std::size_t count, std::uint64_t seed,
                             const std::function<double(std::span<const std::size_t>)>& statistic) {
  FT_CHECK(count > 0);
  IndexSource source(seed);
  std::vector<std::size_t> drawn(count);
  std::vector<double> values(kResamples);
  for (double& value : values) {
    for (std::size_t& index : drawn) index = source.below(count);
    value = statistic(drawn);
  }
  return {quantile(values, 0.05), quantile(values, 0.95)};
}

double rootMeanSquare(std::span<const double> values) {
  const double squares = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  return values.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(values.size()));
}

PairedGain pairedGain(std::span<const double> before, std::span<const double> after, std::uint64_t seed) {
  FT_CHECK(before.size() == after.size() && !before.empty());
  const auto gain_of = [&](std::span<const std::size_t> drawn) {
    double before_squares = 0.0;
    double after_squares = 0.0;
    for (const std::size_t i : drawn) {
      before_squares += before[i] * before[i];
      after_squares += after[i] * after[i];
    }
    return gainOf(before_squares, after_squares);
  };
  std::vector<std::size_t> all(before.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Interval interval = bootstrapInterval90(before.size(), seed, gain_of);
  return {gain_of(all), interval.low, interval.high};
}

PairedDifference pairedDifference(std::span<const double> errors, std::span<const double> of_best, std::uint64_t seed) {
  FT_CHECK(errors.size() == of_best.size() && !errors.empty());
  const auto difference_of = [&](std::span<const std::size_t> drawn) {
    double squares = 0.0;
    double best_squares = 0.0;
    for (const std::size_t i : drawn) {
      squares += errors[i] * errors[i];
      best_squares += of_best[i] * of_best[i];
    }
    const auto n = static_cast<double>(drawn.size());
    return std::sqrt(squares / n) - std::sqrt(best_squares / n);
  };
  std::vector<std::size_t> all(errors.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Interval interval = bootstrapInterval90(errors.size(), seed, difference_of);
  return {difference_of(all), interval.low, interval.high};
}

std::size_t worstPlace(std::span<const double> before, std::span<const double> after) {
  FT_CHECK(before.size() == after.size() && !before.empty());
  const double before_squares = std::inner_product(before.begin(), before.end(), before.begin(), 0.0);
  const double after_squares = std::inner_product(after.begin(), after.end(), after.begin(), 0.0);
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
