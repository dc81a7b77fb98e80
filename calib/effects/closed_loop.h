#pragma once

#include <Eigen/Core>

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A closed conducting ring (a cable with both ends joined, a window frame, a coil of copper) in which the transmitter
/// induces a current.
///
/// Convention: in a field H the transmitter's coil k has the moment 4 pi C e_k. With h(p) the field at p of unit
/// current in the ring, the flux of a moment m at t through it is mu_0 h(t) . m (reciprocity), and where inductance
/// limits the current, as it does in copper at an AC tracker's carrier, the ring keeps the flux out: L I = -flux, so
///   dG = -strength 4 pi C h(p) h(t)^T / (R (ln(8 R/a) - 2)),
/// R and a the radii of ring and wire. Below the carrier at which the ring's resistance equals its reactance only a
/// part of that current flows, which `strength` says; what is left is in quadrature and not seen by the tracker. With
/// the wire's conductivity given, that part is (w L)^2/(R^2 + (w L)^2) at a carrier and exp(-t R/L) at a sampling
/// delay, R at direct current.
/// @source Jackson 1999, Classical Electrodynamics, section 5.5 (field of a current ring); L: Maxwell 1873, art. 704
Effect closedLoopEffect();

/// Field H of unit current in a ring at a place given from its centre.
/// @param from_center_m not on the wire
/// @param axis unit normal of the ring; the current turns right-handed about it
/// @return [1/m]
Eigen::Vector3d ringField_per_m(const Eigen::Vector3d& from_center_m, const Eigen::Vector3d& axis, double radius_m);

}  // namespace fieldtrue
