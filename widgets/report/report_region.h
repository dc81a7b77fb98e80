#pragma once

#include "calib/evaluation/comparison.h"
#include "widgets/report/html_writer.h"

namespace fieldtrue::widgets {

/// What surrounds the scores: coverage with its holes, cells that fold back by name, dependence on orientation, cost of
/// resampling. Nothing where none of it was found out.
void writeRegion(HtmlWriter& html, const evaluation::Comparison& comparison);

}  // namespace fieldtrue::widgets
