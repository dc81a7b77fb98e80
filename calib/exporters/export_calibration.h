#pragma once

#include "calib/exporters/exporter.h"

namespace fieldtrue::exporters {

/// Where a file goes: a path as it is given; in a folder that is there NAME_measured-to-true.EXT.
std::filesystem::path exportPath(const Exporter& exporter, const std::filesystem::path& given,
                                 const ExportOptions& options);

/// Writes a calibration in a format, after asking what stands for all formats.
/// @error kUnsupported where the format cannot be written in the direction asked for, or knows positions only and the
///        correction depends on the sensor, or by more than 1 mm on an orientation that is not chosen; as the format
Result<Written> exportCalibration(const Exporter& exporter, const calibration::Corrector& corrector,
                                  const ExportOptions& options, const std::filesystem::path& path,
                                  const RunControl& control);

}  // namespace fieldtrue::exporters
