#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue {

/// The whole file as bytes. @error kIo with the system's reason.
Result<std::string> readFile(const std::filesystem::path& path);

/// A stream over the file's bytes, for readers that need not hold it whole. @error kIo with the system's reason
Result<std::ifstream> openForReading(const std::filesystem::path& path);

/// Writes beside, syncs to disk, renames over: the path holds either the old or the whole new content, never a part.
/// @param write fills the stream
/// @error kIo with the system's reason (no such folder, no permission, no space left); the old file is untouched
Result<void> writeFileAtomically(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write);

/// Shortest text that reads back to the same double; "nan" for NaN.
std::string formatNumber(double value);

}  // namespace fieldtrue
