#pragma once

#include "calib/exporters/registry.h"

namespace fieldtrue {

/// The registry row of the exporter `ftcal`: the calibration itself, for Fieldtrue and its runtime.
Exporter ftcalExporter();

}  // namespace fieldtrue
