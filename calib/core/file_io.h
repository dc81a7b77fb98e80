#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue {

/// The whole file as bytes.
/// @error kIo with the system's reason; kBadInput for a session, which is not opened: it may be open in this program,
/// and closing a descriptor of it would drop the locks on it
Result<std::string> readFile(const std::filesystem::path& path);

/// A stream over the file's bytes, for readers that need not hold it whole.
/// @error kIo with the system's reason; kBadInput for a session, as above
Result<std::ifstream> openForReading(const std::filesystem::path& path);

/// Lets a write beyond the largest file that the system allows (`ulimit -f`) fail with a reason; by itself the system
/// ends the program there, which leaves behind what was written beside. For the first line of main.
void outliveFileSizeLimit();

/// Writes beside, syncs to disk, renames over: the path holds either the old or the whole new content, never a part.
/// @param write fills the stream
/// @error kIo with the system's reason (no such folder, no permission, no space left); the old file is untouched
Result<void> writeFileAtomically(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write);

/// The same for libraries that write files by name: fills a file beside, which then takes the path's place.
/// @param write fills the file of the name it is given, or says why it cannot
/// @error of write; kIo as above
Result<void> replaceFileAtomically(const std::filesystem::path& path,
                                   const std::function<Result<void>(const std::filesystem::path&)>& write);

/// Shortest text that reads back to the same double; "nan" for NaN.
std::string formatNumber(double value);

}  // namespace fieldtrue
