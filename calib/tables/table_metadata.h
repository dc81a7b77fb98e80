#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue {

/// Interprets the `# key: value` lines of a table; keys that are not known go to `other`.
/// @error kBadInput naming file, line and key for a value that is not what the key needs, or a known key given twice
Result<TableMetadata> parseMetadata(const CsvReader& reader);

/// A sentence for each key that is not known but looks like one that is: another unit, or a slip of the hand.
std::vector<std::string> notesOnMetadata(const CsvReader& reader);

/// Writes what is set as `# key: value` lines.
void writeMetadata(std::ostream& out, const TableMetadata& metadata);

/// What is known, and from `more` what is not known yet.
TableMetadata merged(TableMetadata known, const TableMetadata& more);

}  // namespace fieldtrue
