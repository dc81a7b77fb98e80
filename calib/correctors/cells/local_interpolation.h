#pragma once

#include <memory>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/position_model.h"
#include "calib/correctors/cells/corner_weights.h"

namespace fieldtrue::correctors {

/// A position correction by the weighted sum of the error vectors of the eight corners of the cell around a position.
///
/// Shared by `local_linear`, `local_bump`, `local_kindratenko` and `local_briggs`, which differ in their weights. It is
/// not continuous across the faces of cells: there the corners left behind still have weight.
/// @param cells in tracked space
/// @param v_m of each corner, q - p, tracker frame [m]
/// @source Kindratenko 2000, A survey of electromagnetic position tracker calibration techniques, section 3.3, eq. 8,
/// 12
std::unique_ptr<PositionModel> makeLocalPosition(HexahedralCells cells, std::vector<Eigen::Vector3d> v_m,
                                                 const WeightRule& rule, std::string note);

/// Fits it to places on a grid.
/// @param name stands in messages
/// @error as placeGrid
Result<std::unique_ptr<PositionModel>> fitLocalPosition(const FitData& data, const WeightRule& rule,
                                                        const std::string& name);

/// Of any of the local methods.

/// Error vectors q - p of places, tracker frame [m].
std::vector<Eigen::Vector3d> errorVectors_m(const Places& places);

/// Distance of a position from each corner of a cell [m].
std::array<double, 8> cornerDistances_m(const HexahedralCells& cells, std::size_t cell,
                                        const Eigen::Vector3d& p_tracked_m);

/// Jacobian I + d v / d p by central differences of 0.1 mm of a displacement that stays within one cell.
template <class Displacement>
Eigen::Matrix3d cellJacobian(const Eigen::Vector3d& p_tracked_m, const Displacement& displacement_m) {
  constexpr double kStep_m = 1e-4;
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d difference_m = displacement_m(p_tracked_m + step_m) - displacement_m(p_tracked_m - step_m);
    jacobian.col(axis) += difference_m / (2.0 * kStep_m);
  }
  return jacobian;
}

}  // namespace fieldtrue::correctors
