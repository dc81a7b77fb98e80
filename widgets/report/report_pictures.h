#pragma once

#include <vector>

#include "widgets/report/picture_section.h"
#include "widgets/report/report_data.h"

namespace fieldtrue::widgets {

/// What a report shows: "before", "after", "histogram", "room". Before and after share scale and magnification.
std::vector<CaptionedPicture> reportPictures(const ReportInput& input, const std::vector<PlaceSummary>& places);

}  // namespace fieldtrue::widgets
