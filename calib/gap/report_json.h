#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "calib/core/error.h"
#include "calib/gap/report.h"

namespace fieldtrue::gap {

nlohmann::json toJson(const Isolability& isolability);
/// The document of the design contract. Reading it back gives the same report, its extra keys included.
nlohmann::json toJson(const GapReport& report);

/// Writes `*.gap.json`; the path holds either the old or the whole new report. @error kIo
Result<void> writeGapReport(const std::filesystem::path& path, const GapReport& report);

}  // namespace fieldtrue::gap
