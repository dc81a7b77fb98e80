#pragma once

#include <span>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/orientation/planned_orientations.h"
#include "calib/gap/report.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::gap {

/// What a planned grid will be able to tell, before a day is spent on it.
struct PlanCheck {
  Isolability isolability;                       ///< Which effects it can tell apart.
  evaluation::PlannedOrientations orientations;  ///< What it tells a correction that takes orientation.
};

/// @param scene the tracker, its place in the rig's frame and the tolerances; null = the default tracker one pitch
/// behind the middle of the grid's first face
/// @error kTooFewNodes; kCancelled
Result<PlanCheck> planCheck(std::span<const PlannedPlace> plan, const simulation::Scene* scene,
                            const RunControl& control = {});

}  // namespace fieldtrue::gap
