#pragma once

#include "calib/correctors/base/method.h"
#include "calib/correctors/base/sensor_coils.h"

namespace fieldtrue::correctors {

/// A process over tracked positions, or over tracked poses, of given values in place of true minus tracked positions:
/// the model's displacement is the value foretold. It has no note.
/// @param values of each row, in any unit; their noise is found with the scales
/// @param coils what unequal coils of the sensor would do to the values; none = nothing that is known
/// @error as gaussian_process' own fit
Result<std::unique_ptr<PositionModel>> fitProcessOf(const FitData& data, std::span<const Eigen::Vector3d> values,
                                                    std::optional<CoilEffect> coils, const Settings& settings,
                                                    const RunControl& control);
std::vector<Setting> gaussianProcessSettings();

}  // namespace fieldtrue::correctors
