#pragma once

#include <filesystem>
#include <string>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/gap/report.h"
#include "widgets/figures/picture_request.h"

namespace fieldtrue::widgets {

class HtmlWriter;

/// The part of a page that tells a diagnosis: what was found, the field before and after, charts, findings.
/// @param draw none leaves the pictures of the field out and says so
void writeGapSection(HtmlWriter& html, const gap::GapReport& report, const DrawPictures& draw,
                     const CalibrationTable* table = nullptr);

/// The whole page, UTF-8, well-formed XML.
std::string gapHtml(const gap::GapReport& report, const DrawPictures& draw, const CalibrationTable* table = nullptr);

/// Writes one self-contained HTML page. Where pictures cannot be drawn the page says why.
/// @error kIo, the old file is untouched
Result<void> writeGapHtml(const gap::GapReport& report, const DrawPictures& draw, const std::filesystem::path& path,
                          const CalibrationTable* table = nullptr);

}  // namespace fieldtrue::widgets
