#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {

/// One place of a truth file.
struct TruthPoint {
  std::string label;  ///< Name of the point, or its node number; empty when the file has none.
  Node node;          ///< Identity, grid index, role and true pose; nothing tracked.
};

struct Truth {
  std::vector<TruthPoint> points;
  TableMetadata metadata;
  std::vector<std::string> notes;
};

/// Reads where the points really are: a node table, a 3D Slicer .fcsv, or a CSV with columns x_true_m or true_x_mm or
/// x_true_mm or x_mm or x_m (and y, z) and perhaps a label: `label`, `node`, `id`,
/// `name`, `point` or `place`.
/// @error kIo; kBadInput naming file, line and column
Result<Truth> readTruth(const std::filesystem::path& path);

/// Which truth point each measured point is at: by label where every measured label is there, else by order.
struct TruthMatch {
  std::vector<std::size_t> truth;  ///< Index into Truth::points, one for each measured label.
  std::string note;                ///< How it was matched.
};
/// @param labels of the measured points, in file order; empty texts where there are none
/// @error kBadInput when the labels do not match and the counts differ
Result<TruthMatch> matchTruth(const Truth& truth, const std::vector<std::string>& labels);

}  // namespace fieldtrue::importers
