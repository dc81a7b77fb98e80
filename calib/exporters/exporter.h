#pragma once

#include <filesystem>
#include <string>

#include "calib/calibration/corrector.h"

namespace fieldtrue::exporters {

/// One row of the exporter registry.
struct Exporter {
  std::string id;
  std::string label;
  std::string extension;  ///< ".csv"
  std::string reads_it;   ///< Which programs read the file, for menus.
  Result<void> (*write)(const calibration::Corrector&, const std::filesystem::path&) = nullptr;
};

}  // namespace fieldtrue::exporters
