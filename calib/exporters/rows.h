#pragma once

#include "calib/exporters/exporter.h"

/// The row of every exporter, declared; each is defined in the file of its format, and registry.cpp orders them.
namespace fieldtrue::exporters {

Exporter csvExporter();
Exporter ftcalExporter();

}  // namespace fieldtrue::exporters
