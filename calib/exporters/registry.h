#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "calib/correctors/corrector.h"

namespace fieldtrue {

/// One row of the exporter registry.
struct Exporter {
  std::string id;
  std::string label;
  std::string extension;  ///< ".csv"
  std::string reads_it;   ///< Which programs read the file, for menus.
  Result<void> (*write)(const Corrector&, const std::filesystem::path&) = nullptr;
};

std::span<const Exporter> exporters();
/// @error kBadInput naming the known ids
Result<const Exporter*> findExporter(std::string_view id);

}  // namespace fieldtrue
