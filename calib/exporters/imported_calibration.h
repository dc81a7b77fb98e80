#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/exporters/exporter.h"

namespace fieldtrue::exporters {

/// Files of other programs that hold a calibration: lattices of displacements, measured to true.
struct CalibrationFormat {
  std::string id;
  std::string label;
  std::string unit;  ///< What the numbers of such a file are taken to be.
  /// Exporters whose readers are tried: by the extension, or, with one, whatever the file is called.
  std::vector<std::string> exporter_ids;
};

std::span<const CalibrationFormat> calibrationFormats();
/// Null where no format has that id.
const CalibrationFormat* findCalibrationFormat(std::string_view id);

/// The format whose reader takes a file; null where none does.
const CalibrationFormat* recogniseCalibration(const std::filesystem::path& path);

/// A calibration as another program wrote it. Nobody's measurements are in it: its rows are points of the lattice, its
/// error is not known, and its notes say so.
/// @error kBadInput for what is not such a file, or a lattice that is too large; kIo
Result<calibration::Corrector> importCalibration(const CalibrationFormat& format, const std::filesystem::path& path);

}  // namespace fieldtrue::exporters
