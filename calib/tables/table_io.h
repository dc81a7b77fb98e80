#pragma once

#include <filesystem>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue {

/// A table read from a file, with what the reader wants to tell (unknown columns ignored, and the like).
template <class Table>
struct TableReading {
  Table table;
  std::vector<std::string> notes;
  std::vector<int> lines = {};  ///< Of each row of a node table in its file; else empty.
};

/// Reads a node table (`*.nodes.csv`), streaming; columns by name in any order.
/// @param name stands in error messages ("room.nodes.csv")
/// @error kBadInput naming file, line and column: missing required column, not a number, NaN or infinite, zero
///        quaternion, repeated (node, sensor, visit), truncated last line. Never a partial table.
Result<TableReading<CalibrationTable>> readNodeTable(std::istream& in, const std::string& name);
Result<TableReading<CalibrationTable>> readNodeTable(const std::filesystem::path& path);

/// Reads a sample table (`*.samples.csv`); errors as readNodeTable.
Result<TableReading<SampleTable>> readSampleTable(std::istream& in, const std::string& name);
Result<TableReading<SampleTable>> readSampleTable(const std::filesystem::path& path);

}  // namespace fieldtrue
