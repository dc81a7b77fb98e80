#pragma once

#include <Eigen/Core>

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A metal body small against its distances to transmitter and sensor: the field there induces one dipole.
///
/// Convention: in a field H the body has the magnetic moment m = A H, A in m^3. A dipole m makes the field
/// (3uu^T - I) m / (4 pi r^3), so with G of constant 1/(4 pi) from the body at b to the sensor at p
///   dG = G(p - b; 1/(4 pi)) A G(b; C).
/// A is then -2 pi a^3 for a perfectly conducting sphere of radius a and 4 pi a^3 (mu_r - 1)/(mu_r + 2) for a permeable
/// one (A = V chi with chi = -3/2 and 3 (mu_r - 1)/(mu_r + 2)). Bodies do not see each other's fields.
/// @source Raab, Blood, Steiner, Jones 1979, section on field distortion; sphere: Wait 1951, Geophysics 16 666, limits
/// of high and zero frequency
Effect compactMetalEffect();

/// A of a sphere [m^3].
/// @param relative_permeability used only where ferromagnetic
double spherePolarizability_m3(double radius_m, bool is_ferromagnetic, double relative_permeability);

/// @param center_m tracker frame [m]
/// @param polarizability_m3 A, symmetric, tracker axes
/// @param radius_m within this distance of the centre is metal
std::unique_ptr<CouplingDistortion> makeCompactMetal(const Eigen::Vector3d& center_m,
                                                     const Eigen::Matrix3d& polarizability_m3, double radius_m);

}  // namespace fieldtrue
