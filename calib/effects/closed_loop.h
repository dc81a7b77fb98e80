#pragma once

#include <Eigen/Core>

#include "calib/effects/effect_row.h"

namespace fieldtrue::effects {

/// Field H of unit current in a ring at a place given from its centre.
/// @param from_center_m not on the wire
/// @param axis unit normal of the ring; the current turns right-handed about it
/// @return [1/m]
Eigen::Vector3d ringField_per_m(const Eigen::Vector3d& from_center_m, const Eigen::Vector3d& axis, double radius_m);

}  // namespace fieldtrue::effects
