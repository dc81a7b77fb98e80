#include "acquisition/session/loose_readings.h"

#include <cmath>

namespace fieldtrue::acquisition {

namespace {

constexpr double kBetween_hz = 10.0;
/// About 90 bytes each: 90 MB.
constexpr std::size_t kMostCancelled = 1'000'000;

}  // namespace

bool LooseReadings::isDue(const Sample& sample) {
  // By tenths of a second of the clock, not by the time since the last: 25 readings a second give 10, not 8.
  const double tenth = std::floor(sample.time_s * kBetween_hz + 1e-6);
  const auto [newest, is_first] = newest_tenth_.try_emplace(sample.sensor, tenth);
  const bool due = is_first || newest->second != tenth;
  newest->second = tenth;
  return due;
}

std::vector<LooseSample> LooseReadings::between(const Sample& sample) {
  if (!isDue(sample)) return {};
  return {{sample, std::nullopt}};
}

std::vector<LooseSample> LooseReadings::cancelled(int node, std::span<const Sample> samples) {
  std::vector<LooseSample> kept;
  for (const Sample& sample : samples) {
    if (n_cancelled_ >= kMostCancelled && !isDue(sample)) continue;
    kept.push_back({sample, node});
    ++n_cancelled_;
  }
  return kept;
}

}  // namespace fieldtrue::acquisition
