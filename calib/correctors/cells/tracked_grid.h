#pragma once

#include <string>
#include <vector>

#include "calib/core/settings.h"
#include "calib/correctors/cells/hexahedral_cells.h"

namespace fieldtrue::correctors {

/// `resample`: none (default), briggs, livingston or czernuszenko; and `width_pitches` of Livingston's kernel.
std::vector<Setting> resampleSettings();

/// How the survey's grid in tracked space is read, for the rows of the methods that need one.
std::string trackedGridReading();

/// Error vectors at the nodes of a grid that is rectilinear in tracked space, along the tracker's axes.
struct TrackedGrid {
  HexahedralCells cells;             ///< Boxes along the axes.
  std::vector<Eigen::Vector3d> v_m;  ///< q - p at each corner, tracker frame [m].
  std::string note;
};

/// Places may stand off their level by this share of the pitch; each then counts as standing on it.
inline constexpr double kRectilinearTolerance = 0.02;

/// The grid that the tracked positions form, or with `resample` one of as many levels, to which the error vectors are
/// brought. The first and last level lie half way between the innermost and outermost readings of the outermost
/// levels, so that few nodes lie outside the places and few places outside the nodes. Nodes without support are
/// missing; they are never extrapolated.
/// @param method named in messages
/// @error as checkVolume and placeGrid; kUnsupported when the tracked positions form no such grid and `resample` is
///        none, naming what would help
Result<TrackedGrid> trackedGrid(const FitData& data, const Settings& settings, const std::string& method);

}  // namespace fieldtrue::correctors
