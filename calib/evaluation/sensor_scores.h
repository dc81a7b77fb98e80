#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/candidate.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// Scores of rows, gathered by sensor and place; empty where all rows are of one sensor.
std::vector<SensorScore> scoresBySensor(std::span<const Node> nodes, std::span<const RowScore> scores, bool is_tuned);

/// Whether sensors want a correction each: what is fitted, once to all rows and once to each sensor's alone, is held
/// against each other by the options' folds, ten where they leave places out one by one. Position decides; where it is
/// left as it is, orientation. None where there is one sensor, nothing is corrected, or a sensor cannot be fitted by
/// itself.
/// @param options validation, alignment and seed count
/// @error kCancelled
Result<std::optional<SensorSplit>> splitOf(const CalibrationTable& table, const calibration::CorrectorChoice& choice,
                                           ComparisonOptions options, const RunControl& control);

/// The rows a calibration is fitted to: validation rows stay unseen, skipped ones never count.
std::vector<Node> fitRowsOf(const CalibrationTable& table);

/// Fits to them, with a correction for each sensor where splitOf says that this errs less; the report
/// then tells both figures.
/// @error as Corrector::fit
Result<calibration::Corrector> fitByEvidence(const CalibrationTable& table, calibration::CorrectorChoice choice,
                                             calibration::AlignMode align, const RunControl& control);

}  // namespace fieldtrue::evaluation
