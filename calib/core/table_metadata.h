#pragma once

#include <ostream>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/csv_reader.h"
#include "calib/core/error.h"

namespace fieldtrue {

/// Interprets the `# key: value` lines of a table; keys that are not known go to `other`.
/// @error kBadInput naming file, line and key for a value that is not what the key needs, or a known key given twice
Result<TableMetadata> parseMetadata(const CsvReader& reader);

/// Writes what is set as `# key: value` lines.
void writeMetadata(std::ostream& out, const TableMetadata& metadata);

}  // namespace fieldtrue
