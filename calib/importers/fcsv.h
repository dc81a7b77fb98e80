#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/pose.h"
#include "calib/importers/importer.h"

namespace fieldtrue::importers {

struct FcsvPoint {
  std::string label;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< RAS.
};

struct FcsvPoints {
  std::vector<FcsvPoint> points;
  std::vector<std::string> notes;
};

/// Reads a markups file of 3D Slicer 4.x (mm); LPS files are turned to RAS.
/// @error kIo; kBadInput naming file, line and column, or for a coordinate system that has no metric
Result<FcsvPoints> readFcsv(const std::filesystem::path& path);

}  // namespace fieldtrue::importers
