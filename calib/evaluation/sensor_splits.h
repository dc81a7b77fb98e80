#pragma once

#include <optional>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// Of the parts that a choice corrects, with several sensors.
struct SensorSplits {
  std::optional<SensorSplit> position;
  std::optional<SensorSplit> orientation;
};

/// Whether sensors want a correction each: what is chosen, fitted once to all rows and once to each sensor's alone, is
/// held against each other by the options' validation; where they name none, by the table's roles or in ten folds.
/// @param options validation, alignment and seed count
/// @error kCancelled
Result<SensorSplits> splitsOf(const CalibrationTable& table, const calibration::CorrectorChoice& choice,
                              ComparisonOptions options, const RunControl& control);

/// The rows a calibration is fitted to: validation rows stay unseen, skipped ones never count.
std::vector<Node> fitRowsOf(const CalibrationTable& table);

/// @error kTooFewNodes where there are none, telling what the table's rows are
Result<void> checkFitRows(const CalibrationTable& table);

/// Fits to them, each part with a correction for each sensor where splitsOf says that this errs less; the report then
/// tells both figures.
/// @error as checkFitRows and Corrector::fit
Result<calibration::Corrector> fitByEvidence(const CalibrationTable& table, calibration::CorrectorChoice choice,
                                             calibration::AlignMode align, const RunControl& control);

/// Asks it of a comparison's best methods, where the table holds several sensors, by its own validation; where
/// corrections apart are better, best methods and verdict are theirs.
/// @error kCancelled
Result<void> addSplits(Comparison& comparison, const CalibrationTable& table, const ComparisonOptions& options,
                       const RunControl& control);

}  // namespace fieldtrue::evaluation
