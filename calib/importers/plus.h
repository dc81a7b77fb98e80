#pragma once

#include "calib/importers/registry.h"

namespace fieldtrue {

/// The sample table of fCal (PLUS) recordings: a stylus pivoting on the landmarks of a phantom.
Importer plusImporter();

}  // namespace fieldtrue
