#pragma once

#include <memory>
#include <span>

#include "calib/core/error.h"
#include "calib/correctors/base/orientation_model.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::runtime {

/// An orientation correction baked to a lattice of rotation vectors, in the frame it acts in. One that changes nothing,
/// or turns alike everywhere, comes back as it is.
/// @param places_m tracked positions of the fit
/// @param max_angle_rad bound of the angle between both corrected orientations inside the region [rad]
/// @error as correctors::bakeLattice
Result<std::shared_ptr<const correctors::OrientationModel>> bakeOrientation(
    std::shared_ptr<const correctors::OrientationModel> model, const Region& region,
    std::span<const Eigen::Vector3d> places_m, double max_angle_rad);

}  // namespace fieldtrue::runtime
