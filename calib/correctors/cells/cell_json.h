#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "calib/correctors/base/json_values.h"

namespace fieldtrue::correctors {

/// Points as [[x, y, z], ...].
nlohmann::json jsonOfPoints(const std::vector<Eigen::Vector3d>& points);
/// Rotations as [[w, x, y, z], ...].
nlohmann::json jsonOfRotations(const std::vector<Eigen::Quaterniond>& rotations);

/// The inverses. They throw nlohmann::json::exception when the JSON has another form: call them inside `guarded`.
/// @param count how many there must be; 0 = any
std::vector<Eigen::Vector3d> pointsFrom(const nlohmann::json& json, std::size_t count = 0);
std::vector<Eigen::Quaterniond> rotationsFrom(const nlohmann::json& json, std::size_t count);

/// Corner numbers of cells as rows.
template <std::size_t kCorners>
nlohmann::json jsonOfCells(const std::vector<std::array<int, kCorners>>& cells) {
  return nlohmann::json(cells);
}

/// @param n_points every number must be below
template <std::size_t kCorners>
std::vector<std::array<int, kCorners>> cellsFrom(const nlohmann::json& json, std::size_t n_points) {
  if (!json.is_array() || json.empty()) throwMalformed("cells must be an array of rows of corner numbers");
  std::vector<std::array<int, kCorners>> cells;
  cells.reserve(json.size());
  for (const nlohmann::json& row : json) {
    if (!row.is_array() || row.size() != kCorners)
      throwMalformed("a cell needs " + std::to_string(kCorners) + " corner numbers, got " + row.dump().substr(0, 60));
    std::array<int, kCorners> cell{};
    for (std::size_t c = 0; c < kCorners; ++c) {
      cell[c] = row[c].get<int>();
      if (cell[c] < 0 || static_cast<std::size_t>(cell[c]) >= n_points)
        throwMalformed("a cell has corner " + std::to_string(cell[c]) + " of " + std::to_string(n_points) + " places");
    }
    cells.push_back(cell);
  }
  return cells;
}

}  // namespace fieldtrue::correctors
