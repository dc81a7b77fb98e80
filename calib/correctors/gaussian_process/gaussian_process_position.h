#pragma once

#include <memory>
#include <string>

#include "calib/correctors/base/position_model.h"
#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// A process over positions, fitted.
/// @param field its mean, with the trend; @param noise_m2 of each of the field's centres, beside the nugget
std::unique_ptr<PositionModel> makeGaussianProcess(RadialField field, const GaussianProcessScales& scales,
                                                   Eigen::VectorXd noise_m2, std::string note);

}  // namespace fieldtrue::correctors
