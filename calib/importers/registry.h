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

namespace fieldtrue {

/// What an importer made of foreign files.
struct Import {
  std::optional<CalibrationTable> table;  ///< None when the file has no truth (a trajectory).
  std::optional<SampleTable> samples;     ///< None when the file holds means only.
  std::vector<std::string> notes;         ///< What was assumed, skipped or found, one sentence each.
};

/// One row of the importer registry.
struct Importer {
  std::string id;
  std::string label;
  std::string source;
  std::vector<Setting> settings;  ///< Written `--format id:key=value,...`.
  bool needs_truth = false;       ///< Whether `--truth` must be given.
  Result<Import> (*read)(const std::filesystem::path& in, const std::optional<std::filesystem::path>& truth,
                         const Settings& settings) = nullptr;
};

std::span<const Importer> importers();
/// @error kBadInput naming the known ids
Result<const Importer*> findImporter(std::string_view id);

}  // namespace fieldtrue
