#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace fieldtrue::correctors {

/// For each face the other face of the same key, -1 where there is none. Of three alike the third stays alone.
/// @param keys one a face; two cells that share a face give it the same key
std::vector<int> facePartners(std::span<const std::uint64_t> keys);

/// Numbers of the cells that have a face without a partner, ascending.
/// @param partners of the faces of the first cell, then of the second, and so on
std::vector<std::size_t> outerCells(std::span<const int> partners, std::size_t faces_a_cell);

}  // namespace fieldtrue::correctors
