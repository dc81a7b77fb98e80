#pragma once

#include <filesystem>
#include <string>

#include "calib/core/error.h"
#include "calib/gap/gap_report.h"
#include "widgets/views/error_field.h"

namespace fieldtrue {

class HtmlWriter;

/// The gap at every place as arrows in the rig's frame, with the bodies it is put down to. @param after with the
/// selected effects in the simulation
ErrorField gapField(const GapReport& report, bool after);

/// The part of a page that tells a diagnosis: what was found, the field before and after, charts, findings.
/// @param with_pictures false leaves the pictures of the field out and says so
void writeGapSection(HtmlWriter& html, const GapReport& report, bool with_pictures = true);

/// The whole page, UTF-8, well-formed XML.
std::string gapHtml(const GapReport& report, bool with_pictures = true);

/// Writes one self-contained HTML page. Needs no display; where pictures cannot be drawn the page says why.
/// @error kIo, the old file is untouched
Result<void> writeGapHtml(const GapReport& report, const std::filesystem::path& path);

}  // namespace fieldtrue
