#pragma once

#include <filesystem>
#include <ostream>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue {

void writeNodeTable(std::ostream& out, const CalibrationTable& table);
void writeSampleTable(std::ostream& out, const SampleTable& table);
/// Atomic forms of the above. @error kIo
Result<void> writeNodeTable(const std::filesystem::path& path, const CalibrationTable& table);
Result<void> writeSampleTable(const std::filesystem::path& path, const SampleTable& table);

}  // namespace fieldtrue
