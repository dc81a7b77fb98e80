#pragma once

#include <array>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::correctors {

/// A cell of grid places. Corner c stands at the low end of axis a where bit a of c is 0 and at the high end where it
/// is 1; the survey's 1 to 8 (eq. 1) are corners 0, 1, 3, 2, 4, 5, 7, 6.
struct GridCell {
  std::array<int, 8> corners{};  ///< Into the places.
  bool is_odd = false;           ///< Parity of i + j + k of its low corner: neighbours differ.
  bool is_box = false;           ///< Spans two steps along some axis.
};

/// Places that stand on a grid, and the cells between them.
///
/// Levels that no place has do not count, so indices 0, 2, 4 are neighbours. Where a corner of a cell is missing, the
/// smallest box of the grid takes its place that has all eight corners: two steps along one axis, then along two, then
/// along three; among equals the axis with the shorter steps first. So a place left out inside the grid, on a face or
/// on an edge is still surrounded; the grid's eight corners are not.
struct PlaceGrid {
  Places places;  ///< One a grid index: rows that share an index are averaged.
  std::array<int, 3> counts{};
  std::vector<GridCell> cells;  ///< Those of one step first, then boxes, each in index order.
  int n_boxes = 0;
  int n_empty = 0;  ///< Cells that no box could stand in for.
};

/// Checks that the places, true and tracked, span a volume.
/// @param method named in messages, e.g. "Tetrahedral interpolation"
/// @error as checkPositions; kDegenerate naming methods that do with less
Result<void> checkVolume(const FitData& data, const std::string& method);

/// @param method named in messages
/// @param otherwise what works on scattered places, named in messages, e.g. "tetrahedral"
/// @error as checkVolume; kUnsupported without a grid index or when two places share one; kTooFewNodes without a cell
Result<PlaceGrid> placeGrid(const FitData& data, const std::string& method, const std::string& otherwise);

/// The cells of places that have their grid index.
/// @error kUnsupported when two places more than 2 cm apart share an index; kTooFewNodes without a cell
Result<PlaceGrid> placeGrid(Places places, const std::string& method);

/// Replaces each index by its rank among the levels that occur along its axis.
/// @return how many levels occur along each axis
std::array<int, 3> rankLevels(std::vector<std::array<int, 3>>& index);

/// What the user should know about places that are missing; empty when none is.
std::string gridNote(const PlaceGrid& grid);

/// One sentence after another, empty ones left out.
std::string joinedNotes(const std::vector<std::string>& notes);

}  // namespace fieldtrue::correctors
