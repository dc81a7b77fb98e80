#pragma once

#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/evaluation/candidate.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// Scores of rows, gathered by sensor and place; empty where all rows are of one sensor.
std::vector<SensorScore> scoresBySensor(std::span<const Node> nodes, std::span<const RowScore> scores,
                                        const FitFreedom& freedom);

}  // namespace fieldtrue::evaluation
