#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "calib/core/error.h"
#include "calib/gap/report.h"
#include "calib/gap/report_json.h"

namespace fieldtrue::gap {

/// The inverse of toJson(GapReport). Numbers that the document states in mm and degrees come back to within rounding;
/// keys it does not know are ignored.
/// @param name stands in error messages ("room.gap.json")
/// @error kBadInput naming the key, what was seen and what is needed; kNewerVersion
Result<GapReport> readGapReport(const nlohmann::json& document, const std::string& name);
/// Reads `*.gap.json`. @error kIo and as above
Result<GapReport> readGapReport(const std::filesystem::path& path);

}  // namespace fieldtrue::gap
