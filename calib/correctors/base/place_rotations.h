#pragma once

#include <span>
#include <vector>

#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::correctors {

/// Error rotation of each place: the average over its visits, in whatever orientations.
/// @source Markley, Cheng, Crassidis, Oshman 2007, Averaging Quaternions
std::vector<Eigen::Quaterniond> placeErrorRotations(const FitData& data, const Places& places, ErrorFrame frame);

/// Weighted sum of quaternions, each with the sign that makes it nearer to the first, normalised.
/// @param weights as many as rotations
/// @return the rotation of the largest weight where the sum vanishes
Eigen::Quaterniond weightedRotation(std::span<const Eigen::Quaterniond> rotations, std::span<const double> weights);

}  // namespace fieldtrue::correctors
