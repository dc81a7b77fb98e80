#pragma once

#include <vector>

#include "calib/evaluation/learning_curve.h"
#include "widgets/report/html_writer.h"

namespace fieldtrue::widgets {

/// The held-out error against the number of places used, as a drawing: the best methods, each named at its end, with
/// a logarithmic error axis. Nothing without curves.
void writeLearningCurves(HtmlWriter& html, const std::vector<evaluation::LearningCurve>& curves);

}  // namespace fieldtrue::widgets
