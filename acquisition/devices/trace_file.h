#pragma once

#include <filesystem>

#include "acquisition/devices/line_trace.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// Writes `*.trace.zip` atomically: `settings.json`, `chunks.csv`, `bytes.bin`. @error kIo
Result<void> writeTrace(const std::filesystem::path& path, const Trace& trace);

/// @error kIo, kBadInput: one sentence that names the file and what is wrong in it
Result<Trace> readTrace(const std::filesystem::path& path);

}  // namespace fieldtrue::acquisition
