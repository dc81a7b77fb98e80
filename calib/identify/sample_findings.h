#pragma once

#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/recording/finding.h"
#include "calib/recording/sample_spectrum.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::identify {

/// What single readings show of the tracker's electronics and does not stand in the scene: lines of the mains, noise
/// that follows itself, a lattice, noise that grows with range in another way. Without samples only what the
/// table's own covariances tell.
/// @param samples, scene null = none
/// @param lines what is a line
std::vector<recording::GapFinding> sampleFindings(const SampleTable* samples, const CalibrationTable& table,
                                                  const simulation::Scene* scene,
                                                  const recording::LineRules& lines = {});

}  // namespace fieldtrue::identify
