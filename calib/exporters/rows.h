#pragma once

#include "calib/exporters/exporter.h"

/// The row of every exporter, declared; each is defined in the file of its format, and registry.cpp orders them.
namespace fieldtrue::exporters {

Exporter caveTableExporter();
Exporter csvExporter();
Exporter ftcalExporter();
Exporter itkH5Exporter();
Exporter itkMhaExporter();
Exporter itkNrrdExporter();
Exporter itkTfmExporter();
Exporter latticeCsvExporter();
Exporter matlabExporter();
Exporter numpyExporter();
Exporter plusXmlExporter();
Exporter polynomialCExporter();
Exporter polynomialJsonExporter();
Exporter syzygyTableExporter();
Exporter trackdPluginExporter();
Exporter vrpnCfgExporter();
Exporter vruiForwardGridExporter();
Exporter vruiGridExporter();
Exporter vtkLandmarksExporter();
Exporter vtkVtiExporter();
Exporter vtkVtpExporter();

}  // namespace fieldtrue::exporters
