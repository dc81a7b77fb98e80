#pragma once

#include <optional>
#include <string>

#include "calib/core/run_control.h"
#include "calib/correctors/base/sensor_coils.h"
#include "calib/correctors/gaussian_process/pose_process.h"

namespace fieldtrue::correctors {

/// The strain of the sensor's coils where it explains what changes as the sensor turns; none elsewhere.
struct CoilChoice {
  std::optional<SensorCoils> coils;
  std::string note;  ///< Empty without coils.
};

/// Estimates the strain by generalised least squares under the process over positions, and keeps it if it is 3 nats a
/// parameter more likely than none and takes 3 % off the error at rows whose places are left out.
/// @param start scales of the process over positions; @param used rows
/// @error kCancelled
Result<CoilChoice> chooseCoils(const PoseSystem& system, CoilEffect effect, const GaussianProcessScales& start,
                               std::span<const std::size_t> used, double spacing_m, const RunControl& control);

}  // namespace fieldtrue::correctors
