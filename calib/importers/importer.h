#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/settings.h"

namespace fieldtrue::importers {

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
  std::vector<Setting> settings = {};  ///< Written `--format id:key=value,...`.
  bool needs_truth = false;            ///< Whether `--truth` must be given.
  std::string extension = {};          ///< Tells the format where reading it alone cannot.
  Result<Import> (*read)(const std::filesystem::path& in, const std::optional<std::filesystem::path>& truth,
                         const Settings& settings) = nullptr;
};

}  // namespace fieldtrue::importers
