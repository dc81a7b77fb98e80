#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/settings.h"
#include "calib/importers/importer.h"

namespace fieldtrue::importers {

std::span<const Importer> importers();
/// @error kBadInput naming the known ids
Result<const Importer*> findImporter(std::string_view id);
/// The format that a file is of by what it holds: the first whose reader takes it, tables of chosen columns left out.
/// Null where none does.
const Importer* recogniseRecording(const std::filesystem::path& path);
/// The settings of a format as they are declared.
Settings usualSettings(const Importer& importer);

}  // namespace fieldtrue::importers
