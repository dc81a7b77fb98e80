#pragma once

#include "calib/importers/registry.h"

namespace fieldtrue {

/// The table of Anser EMT's Duplo-board recordings: one condition of it as a node table, positions only.
Importer anserImporter();

}  // namespace fieldtrue
