#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {

/// Points as [[x, y, z], ...].
nlohmann::json jsonOfPoints(const std::vector<Eigen::Vector3d>& points);
/// Rotations as [[w, x, y, z], ...].
nlohmann::json jsonOfRotations(const std::vector<Eigen::Quaterniond>& rotations);

/// The inverses.
/// @param count how many there must be; 0 = any
std::vector<Eigen::Vector3d> pointsFrom(const JsonReader& json, std::size_t count = 0);
std::vector<Eigen::Quaterniond> rotationsFrom(const JsonReader& json, std::size_t count);

/// Corner numbers of cells as rows.
/// @param n_points every number must be below
template <std::size_t kCorners>
std::vector<std::array<int, kCorners>> cellsFrom(const JsonReader& json, std::size_t n_points) {
  const auto cells = json.list([&](const JsonReader& row) {
    const std::vector<int> corners = row.integers();
    if (corners.size() != kCorners) row.refuse(std::to_string(kCorners) + " corner numbers");
    std::array<int, kCorners> cell{};
    for (std::size_t c = 0; c < kCorners; ++c) {
      cell[c] = corners[c];
      if (cell[c] < 0 || static_cast<std::size_t>(cell[c]) >= n_points)
        row.refuse("corner numbers from 0 to " + std::to_string(n_points - 1));
    }
    return cell;
  });
  if (cells.empty()) json.refuse("a list of at least one cell");
  return cells;
}

}  // namespace fieldtrue::correctors
