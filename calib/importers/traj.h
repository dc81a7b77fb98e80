#pragma once

#include "calib/importers/registry.h"

namespace fieldtrue {

/// Trajectories as 4x4 matrices separated by blank lines: samples without truth.
Importer trajImporter();

}  // namespace fieldtrue
