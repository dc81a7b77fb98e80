#pragma once

#include <Eigen/Core>

#include "calib/effects/effect_row.h"

namespace fieldtrue::effects {

/// A of a sphere [m^3].
/// @param relative_permeability used only where ferromagnetic
double spherePolarizability_m3(double radius_m, bool is_ferromagnetic, double relative_permeability);

/// @param center_m tracker frame [m]
/// @param polarizability_m3 A, symmetric, tracker axes
/// @param radius_m within this distance of the centre is metal
std::unique_ptr<field::CouplingDistortion> makeCompactMetal(const Eigen::Vector3d& center_m,
                                                            const Eigen::Matrix3d& polarizability_m3, double radius_m);

}  // namespace fieldtrue::effects
