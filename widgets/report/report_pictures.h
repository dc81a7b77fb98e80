#pragma once

#include <QImage>
#include <string>
#include <vector>

#include "widgets/report/report_data.h"

namespace fieldtrue {

/// One picture of a report, for a light and for a dark page.
struct ReportPicture {
  std::string id;  ///< "before", "after", "histogram", "room".
  QImage light;
  QImage dark;
  std::string caption;
};

struct ReportPictures {
  std::vector<ReportPicture> drawn;
  std::string missing;  ///< Why some or all could not be drawn; empty when all are there.
};

/// Draws what a report shows. Before and after share scale and magnification.
ReportPictures drawReportPictures(const ReportInput& input, const std::vector<PlaceSummary>& places);

}  // namespace fieldtrue
