#pragma once

#include "calib/importers/importer.h"

/// The row of every importer, declared; each is defined in the file of its format, and registry.cpp orders them.
namespace fieldtrue::importers {

Importer anserImporter();
Importer columnsImporter();
Importer fcsvImporter();
Importer nodesImporter();
Importer plusImporter();
Importer plusSequenceImporter();
Importer trajImporter();

}  // namespace fieldtrue::importers
