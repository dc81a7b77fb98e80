#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/learning_curve.h"
#include "calib/gap/report.h"
#include "widgets/figures/picture_request.h"

namespace fieldtrue::widgets {

/// Everything a report tells. The same input always gives the same page.
struct ReportInput {
  CalibrationTable table;                                  ///< The rows that were compared.
  evaluation::Comparison comparison;                       ///< Of that table.
  std::vector<evaluation::LearningCurve> learning_curves;  ///< Of that table; empty = not asked for.
  std::optional<gap::GapReport> gap;                       ///< The diagnosis of that table; none = not asked for.
  std::string source;                                      ///< The file the table came from.
  std::string plan;                                        ///< How the places were planned; empty = not known.
  std::vector<PlannedPlace> places;             ///< What was planned, in visiting order; empty = the table's places.
  std::vector<acquisition::PlaceState> states;  ///< One per planned place.
  std::string made_at;                          ///< When the report was made, as text.
  std::uint64_t seed = 1;                       ///< Of folds and bootstrap.
  std::vector<std::string> notes;               ///< Remarks of whoever read the input.
  DrawPictures draw;                            ///< None leaves the pictures out and says so.
};

/// Writes one self-contained HTML page: verdict, error field before and after, method tables, what was measured, places
/// and provenance. Where pictures cannot be drawn the page says why.
/// @error kIo, the old file is untouched
Result<void> writeHtmlReport(const ReportInput& input, const std::filesystem::path& path);

/// The page itself, UTF-8, well-formed XML.
std::string htmlReport(const ReportInput& input);

}  // namespace fieldtrue::widgets
