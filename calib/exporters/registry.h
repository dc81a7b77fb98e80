#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "calib/calibration/corrector.h"
#include "calib/exporters/exporter.h"

namespace fieldtrue::exporters {

std::span<const Exporter> exporters();
/// @error kBadInput naming the known ids
Result<const Exporter*> findExporter(std::string_view id);

}  // namespace fieldtrue::exporters
