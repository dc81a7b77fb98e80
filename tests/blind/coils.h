#pragma once

#include <vector>

#include "tests/blind/physics.h"

namespace blind {

/// Closed polygon of straight wire; the last corner joins the first [m].
using Polygon = std::vector<Vector3d>;

/// Regular polygon with the area of a circle of the given radius.
Polygon roundLoop(const Vector3d& center_m, const Vector3d& normal, double radius_m, int corners);

/// Rectangle with two given half sides [m].
Polygon rectangle(const Vector3d& center_m, const Vector3d& half_a_m, const Vector3d& half_b_m);

/// Field of unit current around a polygon, mu0 / (4 pi) = 1.
/// @source Hanson and Hirshman, Physics of Plasmas 9 (2002), equation 9
Vector3d loopField(const Polygon& polygon, const Vector3d& p_m);

/// Area vector of a polygon [m^2]: the moment of unit current.
Vector3d areaVector(const Polygon& polygon);

/// Flux of each of the three unit dipoles at the origin through a polygon: its line integral of m x r / r^3.
Eigen::RowVector3d dipoleFlux(const Polygon& polygon);

/// Inductance of a round loop of round wire, current at its surface.
/// @return [H]
/// @source Rosa, Bulletin of the Bureau of Standards 4 (1908), 301
double roundLoopInductance(double radius_m, double wire_radius_m);

/// Field matrix of three centred square coils of unit moment, the receiver a mean over square coils.
/// @param p_m from the transmitter to the receiver, transmitter frame [m]
/// @param tracker_from_sensor attitude of the receiver
/// @param transmitter_half_m half side of the transmitter coils [m], 0: dipoles
/// @param receiver_half_m half side of the receiver coils [m], 0: points
/// @return couplings, rows receiver coils, columns transmitter coils
Matrix3d coilCouplings(const Vector3d& p_m, const Matrix3d& tracker_from_sensor, double transmitter_half_m,
                       double receiver_half_m);

}  // namespace blind
