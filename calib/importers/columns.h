#pragma once

#include "calib/importers/registry.h"

namespace fieldtrue {

/// Any table with a header row: the settings name its columns, unit and separator.
Importer columnsImporter();

}  // namespace fieldtrue
