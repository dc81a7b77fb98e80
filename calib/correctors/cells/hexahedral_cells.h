#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/correctors/cells/place_grid.h"
#include "calib/correctors/numerics/box_lookup.h"

namespace fieldtrue::correctors {

/// Hexahedra between measured places, in tracked space, and where a position lies in them.
///
/// Inside a cell, natural coordinates (r, s, t) run from 0 to 1 between the corners; the position is the trilinear
/// mixture of the corners (the isoparametric map), so that cells which share a face meet without gap or overlap.
/// A position outside of all cells, by at most a quarter of a cell, belongs to the nearest: natural coordinates from
/// -0.25 to 1.25. On a shared face, edge or corner the cell of the lowest number has it.
class HexahedralCells {
 public:
  using Corners = std::array<int, 8>;

  struct Location {
    std::size_t cell = 0;
    Eigen::Vector3d natural = Eigen::Vector3d::Zero();
  };

  HexahedralCells() = default;
  /// @param corners_m corner positions, tracker frame [m]
  /// @param cells numbers of the corners of each cell, ordered as in GridCell; must exist
  HexahedralCells(std::vector<Eigen::Vector3d> corners_m, std::vector<Corners> cells);
  /// Of the tracked positions of a grid's places.
  static HexahedralCells of(const PlaceGrid& grid);

  std::optional<Location> locate(const Eigen::Vector3d& p_tracked_m) const;

  std::size_t size() const { return cells_.size(); }
  const Corners& corners(std::size_t cell) const { return cells_[cell]; }
  const std::vector<Eigen::Vector3d>& corners_m() const { return corners_m_; }
  const Eigen::Vector3d& corner_m(std::size_t cell, std::size_t corner) const {
    return corners_m_[static_cast<std::size_t>(cells_[cell][corner])];
  }
  /// Position of natural coordinates, tracker frame [m].
  Eigen::Vector3d position_m(const Location& at) const;
  /// d position / d natural coordinates [m].
  Eigen::Matrix3d tangent_m(const Location& at) const;

  /// Cells with corners where the isoparametric map turns the other way than in most cells: the field folds back.
  std::vector<std::size_t> foldedCells() const;

  /// {"tracked_m": [[x, y, z], ...], "cells": [[8 numbers], ...]}
  nlohmann::json toJson() const;
  static HexahedralCells fromJson(const JsonReader& json);

 private:
  /// Position as a polynomial of the natural coordinates: coefficients of 1, r, s, t, rs, rt, st, rst [m].
  using Coefficients = std::array<Eigen::Vector3d, 8>;

  std::optional<Eigen::Vector3d> natural(std::size_t cell, const Eigen::Vector3d& p_tracked_m) const;
  std::optional<Location> locateInside(const Eigen::Vector3d& p_tracked_m) const;
  std::optional<Location> locateAround(const Eigen::Vector3d& p_tracked_m) const;

  std::vector<Eigen::Vector3d> corners_m_;
  std::vector<Corners> cells_;
  std::vector<Coefficients> coefficients_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  BoxLookup lookup_;
  std::vector<std::size_t> outer_;  ///< Cells with a face of their own, and their boxes with the margin around.
  std::vector<Eigen::AlignedBox3d> outer_boxes_;
  BoxLookup outer_lookup_;
};

/// Weights of the eight corners at natural coordinates, adding up to 1.
/// @source Kindratenko 2000, A survey of electromagnetic position tracker calibration techniques, section 3.1, eq. 1
std::array<double, 8> trilinearWeights(const Eigen::Vector3d& natural);

/// d weight / d natural coordinates.
std::array<Eigen::Vector3d, 8> trilinearSlopes(const Eigen::Vector3d& natural);

/// A face that two cells have in common.
struct SharedFace {
  std::size_t first_cell = 0;
  std::size_t second_cell = 0;
  std::array<int, 4> corners{};  ///< Around the face.
};
std::vector<SharedFace> sharedFaces(const HexahedralCells& cells);

/// Trilinear mixture of vectors that belong to the corners.
/// @param values one for each of cells.corners_m()
Eigen::Vector3d trilinearValue(const HexahedralCells& cells, const HexahedralCells::Location& at,
                               const std::vector<Eigen::Vector3d>& values);

/// d trilinearValue / d position.
Eigen::Matrix3d trilinearGradient(const HexahedralCells& cells, const HexahedralCells::Location& at,
                                  const std::vector<Eigen::Vector3d>& values);

/// "N cells fold back near places ..."; empty when none does.
std::string foldNote(const HexahedralCells& cells, const Places& places);

}  // namespace fieldtrue::correctors
