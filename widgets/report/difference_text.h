#pragma once

#include <string>
#include <vector>

#include "calib/evaluation/calibration_difference.h"

namespace fieldtrue::widgets {

/// One line of what is told about two calibrations.
struct DifferenceFact {
  std::string label;
  std::string text;
};

/// Every figure in words, in the order in which they are read; the verdict is CalibrationDifference::text.
std::vector<DifferenceFact> differenceFacts(const evaluation::CalibrationDifference& difference);

}  // namespace fieldtrue::widgets
