#include "calib/evaluation/base/index_source.h"

namespace fieldtrue::evaluation {

std::size_t IndexSource::below(std::size_t count) {
  // SplitMix64 (Steele, Lea, Flood 2014), scaled by the high half.
  state_ += 0x9e3779b97f4a7c15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return static_cast<std::size_t>(((z >> 32) * static_cast<std::uint64_t>(count)) >> 32);
}

}  // namespace fieldtrue::evaluation
