#pragma once

#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/candidate.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// Scores of rows, gathered by sensor and place; empty where all rows are of one sensor.
std::vector<SensorScore> scoresBySensor(std::span<const Node> nodes, std::span<const RowScore> scores, bool is_tuned);

/// Fits the comparison's best position method to each sensor's rows alone, and holds both against each other. None
/// where there is one sensor, no best method, or a sensor with too few places.
/// @error kCancelled
Result<std::optional<SensorSplit>> splitOf(const Comparison& comparison, const CalibrationTable& table,
                                           const ComparisonOptions& options, const RunControl& control);

}  // namespace fieldtrue::evaluation
