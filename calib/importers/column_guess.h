#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/settings.h"

namespace fieldtrue::importers {

/// What a text table seems to hold.
struct ColumnGuess {
  Settings settings;                 ///< Of format `columns`; blank where nothing was recognised.
  std::vector<std::string> reasons;  ///< Why, one sentence each; what could not be told too.
  bool has_unit = false;             ///< False: the unit could not be told, a person must choose it.
};

/// Guesses separator, header, columns and unit from the names and the first rows; what the numbers leave open is said.
/// @error kBadInput for what is no table of text; kIo
Result<ColumnGuess> guessColumns(const std::filesystem::path& path);

/// The settings that differ from the usual ones, as `import --format` takes them.
std::string formatText(const Settings& settings);

}  // namespace fieldtrue::importers
