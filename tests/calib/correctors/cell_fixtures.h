#pragma once

#include <algorithm>
#include <cmath>

#include "tests/calib/correctors/fit_fixtures.h"

namespace fieldtrue::testing {

/// An error field that bends as a room's does: centimetres over metres [m].
inline Eigen::Vector3d bending_m(const Eigen::Vector3d& p) {
  return {0.03 * std::sin(2.0 * p.x() + p.y()), 0.04 * std::cos(1.5 * p.y() + p.z()), 0.02 * p.x() * p.z()};
}

/// The data without one row.
inline correctors::FitData without(correctors::FitData data, std::size_t row) {
  const auto drop = [row](auto& rows) {
    if (!rows.empty()) rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(row));
  };
  drop(data.p_tracked_m);
  drop(data.p_true_m);
  drop(data.q_tracked);
  drop(data.q_true);
  drop(data.node);
  drop(data.index);
  return data;
}

/// Row of a grid index.
inline std::size_t rowAt(const correctors::FitData& data, const std::array<int, 3>& index) {
  return static_cast<std::size_t>(std::find(data.index.begin(), data.index.end(), index) - data.index.begin());
}

/// The eight corners of a cube, corner c high along axis a where bit a of c is set.
inline std::vector<Eigen::Vector3d> cube(double side_m, const Eigen::Vector3d& low_m = Eigen::Vector3d::Zero()) {
  std::vector<Eigen::Vector3d> corners_m;
  for (unsigned c = 0; c < 8; ++c)
    corners_m.push_back(low_m + side_m * Eigen::Vector3d(c & 1U, (c >> 1U) & 1U, (c >> 2U) & 1U));
  return corners_m;
}

using Given = std::map<std::string, std::string>;

/// Fits what must be fitted.
inline std::unique_ptr<correctors::PositionModel> fitted(const std::string& id, const correctors::FitData& data,
                                                         const Given& given = {}) {
  auto model = fitPosition(id, data, given);
  FT_CHECK(model.has_value());
  return *std::move(model);
}

/// A grid of cubes turned about z.
inline correctors::FitData turnedGrid(double angle_rad, const std::array<int, 3>& counts) {
  std::vector<Eigen::Vector3d> points_m = shakenGrid(counts, 0.2, 0.0);
  correctors::FitData straight = fitDataOf(points_m, linear_m);
  const Eigen::AngleAxisd turn(angle_rad, Eigen::Vector3d::UnitZ());
  for (Eigen::Vector3d& p_m : points_m) p_m = turn * p_m;
  correctors::FitData data = fitDataOf(points_m, linear_m);
  data.index = straight.index;
  return data;
}

}  // namespace fieldtrue::testing
