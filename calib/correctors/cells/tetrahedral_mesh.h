#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/correctors/numerics/box_lookup.h"

namespace fieldtrue::correctors {

/// Tetrahedra between measured places, in tracked space, and where a position lies in them.
///
/// A position outside of all, by at most a quarter of a tetrahedron's height over a face of its own, belongs to the
/// nearest. On a shared face, edge or corner the tetrahedron of the lowest number has it.
/// @source Kenwright, Lane 1996, in Kindratenko 2000, section 3.2, eq. 7
class TetrahedralMesh {
 public:
  using Corners = std::array<int, 4>;

  struct Location {
    std::size_t cell = 0;
    std::array<double, 4> weights{};  ///< Of the corners, adding up to 1.
  };

  TetrahedralMesh() = default;
  /// @param corners_m corner positions, tracker frame [m]
  /// @param cells numbers of the corners of each tetrahedron; must exist; flat ones are left out
  TetrahedralMesh(std::vector<Eigen::Vector3d> corners_m, const std::vector<Corners>& cells);

  std::optional<Location> locate(const Eigen::Vector3d& p_tracked_m) const;

  std::size_t size() const { return cells_.size(); }
  const Corners& corners(std::size_t cell) const { return cells_[cell].corners; }
  const std::vector<Eigen::Vector3d>& corners_m() const { return corners_m_; }
  /// d weight / d position of the first three corners as rows [1/m]; the fourth's is minus their sum.
  const Eigen::Matrix3d& slopes_1_m(std::size_t cell) const { return cells_[cell].slopes_1_m; }

  /// {"tracked_m": [[x, y, z], ...], "cells": [[4 numbers], ...]}
  nlohmann::json toJson() const;
  static TetrahedralMesh fromJson(const JsonReader& json);

 private:
  struct Cell {
    Corners corners{};
    Eigen::Matrix3d slopes_1_m;
    Eigen::Vector3d last_m;  ///< The fourth corner, p4 of eq. 7.
    Eigen::AlignedBox3d box;
  };

  /// A tetrahedron with faces of its own: those opposite the corners marked.
  struct Outer {
    std::size_t cell = 0;
    std::array<bool, 4> is_own{};
  };

  static std::array<double, 4> weights(const Cell& cell, const Eigen::Vector3d& p_tracked_m);
  static double overshoot(const Outer& outer, const std::array<double, 4>& weights);
  std::optional<Location> locateAround(const Eigen::Vector3d& p_tracked_m) const;
  void findOuter(const std::vector<Corners>& cells);

  std::vector<Eigen::Vector3d> corners_m_;
  std::vector<Cell> cells_;
  BoxLookup lookup_;
  std::vector<Outer> outer_;
  BoxLookup outer_lookup_;
};

/// Six times the signed volume of a tetrahedron, divided by the cube of its longest edge: 0 when it is flat, 0.71 in
/// magnitude when it is regular.
double relativeVolume(const TetrahedralMesh::Corners& cell, const std::vector<Eigen::Vector3d>& corners_m);

}  // namespace fieldtrue::correctors
