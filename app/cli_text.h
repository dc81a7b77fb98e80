#pragma once

#include <string>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/learning_curve.h"

/// What people read on the terminal.
namespace fieldtrue::cli {

/// A table with the first column left-aligned and the others right-aligned, two blanks between columns.
/// A row of one cell is printed as it is.
std::string alignedColumns(const std::vector<std::vector<std::string>>& rows);

/// "1.25 mm"; "-" for a figure that there is not.
std::string millimetres(double value_mm);

/// In-sample figures of a fit.
std::string fitText(const calibration::Corrector& corrector, calibration::AlignMode align, std::size_t n_unused);

/// The methods' held-out errors, learning curves where there are any, what surrounds the scores, the verdict last.
std::string comparisonText(const evaluation::Comparison& comparison,
                           const std::vector<evaluation::LearningCurve>& curves = {});

}  // namespace fieldtrue::cli
