#include "tests/blind/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace blind {
namespace {

constexpr double kNormal975 = 1.959963984540054;
constexpr int kResamples = 2000;
constexpr std::uint64_t kSeed = 20150125;
constexpr std::size_t kBins = 10;
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

template <typename Value, typename Function>
Interval resampled(std::span<const Value> values, const Function& statistic) {
  if (values.empty()) return {kNothing, kNothing, kNothing, 0};
  std::mt19937_64 random(kSeed);
  std::vector<Value> drawn(values.begin(), values.end());
  std::vector<double> results;
  results.reserve(kResamples);
  for (int round = 0; round < kResamples; ++round) {
    // The modulo keeps draws the same on every standard library; its bias is below 1e-15 here.
    for (Value& value : drawn) value = values[random() % values.size()];
    results.push_back(statistic(std::span<const Value>(drawn)));
  }
  return {statistic(values), quantileOf(results, 0.025), quantileOf(results, 0.975), values.size()};
}

double brierOf(std::span<const Forecast> forecasts) {
  double sum = 0.0;
  for (const Forecast& forecast : forecasts) {
    const double difference = forecast.probability - (forecast.is_right ? 1.0 : 0.0);
    sum += difference * difference;
  }
  return sum / static_cast<double>(forecasts.size());
}

}  // namespace

Interval wilson(std::size_t hits, std::size_t count) {
  if (count == 0) return {kNothing, kNothing, kNothing, 0};
  const double n = static_cast<double>(count);
  const double share = static_cast<double>(hits) / n;
  const double z2 = kNormal975 * kNormal975;
  const double middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
  const double half = kNormal975 / (1.0 + z2 / n) * std::sqrt(share * (1.0 - share) / n + z2 / (4.0 * n * n));
  // None and all are ends of the scale themselves; the formula meets them only up to rounding.
  return {share, hits == 0 ? 0.0 : middle - half, hits == count ? 1.0 : middle + half, count};
}

double quantileOf(std::span<const double> values, double share) {
  if (values.empty()) return kNothing;
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double at = share * static_cast<double>(sorted.size() - 1);
  const std::size_t below = static_cast<std::size_t>(std::floor(at));
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

double meanOf(std::span<const double> values) {
  if (values.empty()) return kNothing;
  double sum = 0.0;
  for (double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

Interval bootstrap(std::span<const double> values, const Statistic& statistic) { return resampled(values, statistic); }

Interval ratioOfSums(std::span<const Tally> sessions) {
  return resampled(sessions, [](std::span<const Tally> some) {
    Tally sum;
    for (const Tally& one : some) sum = {sum.hits + one.hits, sum.count + one.count};
    return sum.hits / sum.count;
  });
}

Interval pooledShare(std::span<const Tally> sessions) {
  std::vector<Tally> counted;
  double count = 0.0;
  for (const Tally& one : sessions) {
    if (one.count <= 0.0) continue;
    counted.push_back(one);
    count += one.count;
  }
  Interval interval = ratioOfSums(counted);
  interval.count = static_cast<std::size_t>(count);
  return interval;
}

Interval brierScore(std::span<const Forecast> forecasts) { return resampled(forecasts, brierOf); }

double expectedCalibrationError(std::span<const Forecast> forecasts) {
  if (forecasts.empty()) return kNothing;
  std::array<double, kBins> stated{};
  std::array<double, kBins> right{};
  for (const Forecast& forecast : forecasts) {
    const double scaled = std::clamp(forecast.probability, 0.0, 1.0) * static_cast<double>(kBins);
    const std::size_t bin = std::min(kBins - 1, static_cast<std::size_t>(scaled));
    stated[bin] += forecast.probability;
    right[bin] += forecast.is_right ? 1.0 : 0.0;
  }
  double sum = 0.0;
  for (std::size_t bin = 0; bin < kBins; ++bin) sum += std::abs(stated[bin] - right[bin]);
  return sum / static_cast<double>(forecasts.size());
}

Interval calibrationError(std::span<const Forecast> forecasts) {
  return resampled(forecasts, expectedCalibrationError);
}

}  // namespace blind
