#include "calib/correctors/cells/face_pairs.h"

#include <bit>

namespace fieldtrue::correctors {

std::vector<int> facePartners(std::span<const std::uint64_t> keys) {
  // A table with open addressing: sorting the faces took longer than all else in joining a grid's cells.
  const std::size_t size = std::bit_ceil(2 * keys.size() + 1);
  std::vector<int> slots(size, -1);
  std::vector<int> partners(keys.size(), -1);
  for (std::size_t face = 0; face < keys.size(); ++face) {
    constexpr std::uint64_t kGoldenRatio = 0x9e3779b97f4a7c15ULL;
    std::size_t slot = static_cast<std::size_t>((keys[face] * kGoldenRatio) >> 32U) & (size - 1);
    while (slots[slot] >= 0 && keys[static_cast<std::size_t>(slots[slot])] != keys[face])
      slot = (slot + 1) & (size - 1);
    const int other = slots[slot];
    if (other < 0) {
      slots[slot] = static_cast<int>(face);
    } else if (partners[static_cast<std::size_t>(other)] < 0) {
      partners[static_cast<std::size_t>(other)] = static_cast<int>(face);
      partners[face] = other;
    }
  }
  return partners;
}

std::vector<std::size_t> outerCells(std::span<const int> partners, std::size_t faces_a_cell) {
  std::vector<std::size_t> outer;
  for (std::size_t face = 0; face < partners.size(); ++face) {
    const std::size_t cell = face / faces_a_cell;
    if (partners[face] < 0 && (outer.empty() || outer.back() != cell)) outer.push_back(cell);
  }
  return outer;
}

}  // namespace fieldtrue::correctors
