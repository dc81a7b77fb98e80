#pragma once

#include <Eigen/Core>

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A flat metal floor, wall or ceiling much larger than the distances: an image of the transmitter stands behind it.
///
/// A dipole m in front of the plane has the image I m at the mirrored point. A perfect conductor lets no field through
/// it (normal field zero on it): I = 1 - 2nn^T. A permeable half-space: I = -(mu_r - 1)/(mu_r + 1) (1 - 2nn^T), in the
/// limit with the tangential field zero on it. With the image at b
///   dG = strength G(p - b; C) I.
/// A plane of given conductivity, and thickness unless it is solid, has several images further behind it, which
/// together reflect as the tracker's carrier or sampling delay makes it (calib/field/plane_images.h). Edges are not
/// modelled and planes do not mirror each other.
/// @source Jackson 1999, Classical Electrodynamics, problem 5.17 (images in a permeable half-space); perfect conductor:
/// the same with mu_r -> 0; sheet: Saslow 1992, Am. J. Phys. 60 693
Effect metalPlaneEffect();

}  // namespace fieldtrue
