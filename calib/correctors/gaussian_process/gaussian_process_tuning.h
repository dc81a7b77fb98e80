#pragma once

#include <optional>
#include <span>

#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"

namespace fieldtrue::correctors {

/// Maximises the restricted likelihood, with a weak prior that keeps what the data do not tell within bounds: several
/// seeded starts on few places, then the best of them on all that are given.
/// @param places as in `full`; the starts use a well-spread part of them
/// @return none when no start leads anywhere, or on a request to stop
std::optional<GaussianProcessScales> fitScales(RadialKernel kernel, const FieldFrame& frame,
                                               std::span<const Eigen::Vector3d> p_m, const Eigen::MatrixXd& y,
                                               const Eigen::VectorXd& noise_m2, int restarts,
                                               const RunControl& control);

}  // namespace fieldtrue::correctors
