#pragma once

#include <filesystem>
#include <string>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/gap/gap_report.h"
#include "widgets/views/error_field.h"

namespace fieldtrue {

class HtmlWriter;

/// The gap at every place as arrows in the rig's frame, with the bodies it is put down to. @param after with the
/// selected effects in the simulation
/// @param table the rows diagnosed, whose places are drawn; null = as near as the report tells them
ErrorField gapField(const GapReport& report, bool after, const CalibrationTable* table = nullptr);

/// The part of a page that tells a diagnosis: what was found, the field before and after, charts, findings.
/// @param with_pictures false leaves the pictures of the field out and says so
void writeGapSection(HtmlWriter& html, const GapReport& report, bool with_pictures = true,
                     const CalibrationTable* table = nullptr);

/// The whole page, UTF-8, well-formed XML.
std::string gapHtml(const GapReport& report, bool with_pictures = true, const CalibrationTable* table = nullptr);

/// Writes one self-contained HTML page. Needs no display; where pictures cannot be drawn the page says why.
/// @error kIo, the old file is untouched
Result<void> writeGapHtml(const GapReport& report, const std::filesystem::path& path,
                          const CalibrationTable* table = nullptr);

}  // namespace fieldtrue
