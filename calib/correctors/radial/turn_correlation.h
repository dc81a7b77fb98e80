#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "calib/correctors/radial/rbf_kernels.h"

namespace fieldtrue::correctors {

/// Squares of c / length of a rotation with each of others, c = 2 sin(angle/2) the chord between the two; so is
/// q = -q. @param squares out, as many as others
void squaredChords(double length_rad, const Eigen::Quaterniond& q, std::span<const Eigen::Quaterniond> others,
                   double* squares);

/// kernel(c / turn_length_rad) of a rotation with each of others; the second form allocates nothing.
Eigen::VectorXd turnCorrelation(RadialKernel kernel, double turn_length_rad, const Eigen::Quaterniond& q,
                                std::span<const Eigen::Quaterniond> others);
void turnCorrelation(RadialKernel kernel, double turn_length_rad, const Eigen::Quaterniond& q,
                     std::span<const Eigen::Quaterniond> others, double* correlation);

}  // namespace fieldtrue::correctors
