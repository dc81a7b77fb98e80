#pragma once

#include <cstddef>
#include <cstdint>

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

}  // namespace fieldtrue::evaluation
