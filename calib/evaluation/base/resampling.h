#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace fieldtrue::evaluation {

/// A seeded source of uniform indices, the same on every platform (std::uniform_int_distribution is not).
class IndexSource {
 public:
  explicit IndexSource(std::uint64_t seed) : state_(seed) {}
  /// In [0, count), count below 2^32.
  std::size_t below(std::size_t count);

 private:
  std::uint64_t state_;
};

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// 90 % percentile interval of a statistic of `count` places over 2,000 resamples with replacement.
/// @param statistic of the places with these indices
/// @source Efron 1979
Interval bootstrapInterval90(std::size_t count, std::uint64_t seed,
                             const std::function<double(std::span<const std::size_t>)>& statistic);

double rootMeanSquare(std::span<const double> values);

/// What a correction gains on places its fits did not see: 1 - RMS after / RMS before, with its paired 90 % interval.
struct PairedGain {
  double gain = 0.0;
  double low90 = 0.0;
  double high90 = 0.0;
};

/// @param before, after errors of the same places, same order and unit
PairedGain pairedGain(std::span<const double> before, std::span<const double> after, std::uint64_t seed);

/// RMS of one method minus that of another on the same places, with its paired 90 % interval.
struct PairedDifference {
  double difference = 0.0;
  double low90 = 0.0;
  double high90 = 0.0;
};

/// @param errors, of_best of the same places, same order and unit
PairedDifference pairedDifference(std::span<const double> errors, std::span<const double> of_best, std::uint64_t seed);

/// The place whose removal lowers the gain most.
std::size_t worstPlace(std::span<const double> before, std::span<const double> after);

}  // namespace fieldtrue::evaluation
