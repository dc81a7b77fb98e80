#pragma once

#include <optional>
#include <vector>

#include "calib/field/metal_response.h"

namespace fieldtrue::field {

/// An image of the transmitter behind a plane.
struct PlaneImage {
  double deeper_m = 0.0;  ///< Beyond the mirrored point.
  double strength = 1.0;  ///< Of the image of a perfect conductor.
};

/// Images that together reflect as a slab of metal does, as a tracker sees it: sum of strength exp(-k deeper) equals
/// the seen reflection of every field of horizontal wave number k from 0.02 to 60 per metre, to about 1e-4 of a perfect
/// conductor's.
///
/// A thin conducting sheet at a sampling delay t needs one alone, w t deeper, w = 2/(mu_0 sigma d): Maxwell's receding
/// image. A thick conductor at a carrier answers as one at the complex depth (1 - i) delta, delta the skin depth.
/// @param thickness_m none = a half-space
/// @source Maxwell 1872, Proc. R. Soc. 20 160; Saslow 1992, Am. J. Phys. 60 693; complex image: Wait and Spies 1969,
/// Can. J. Phys. 47 2731
std::vector<PlaneImage> planeImages(const Metal& metal, std::optional<double> thickness_m,
                                    const Excitation& excitation);

/// Reflection of a field of wave number k by these images.
double reflectionOf(const std::vector<PlaneImage>& images, double k_per_m);

}  // namespace fieldtrue::field
