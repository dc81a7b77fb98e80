#pragma once

#include "calib/exporters/registry.h"

namespace fieldtrue {

/// The registry row of the exporter `csv`: a node table with the errors before and after this calibration.
Exporter csvExporter();

}  // namespace fieldtrue
