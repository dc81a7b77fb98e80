#pragma once

#include "calib/exporters/lattice_export.h"

namespace fieldtrue::exporters {

/// Samples a lattice of a given pitch, lets the format write it, reads it back and tells how far it is off. Refuses
/// only where a largest deviation was asked for and is exceeded; then nothing is written.
Result<Written> writeFixedLattice(const ExportSubject& subject, const ExportOptions& options,
                                  const std::filesystem::path& path, const LatticePoints& points,
                                  const LatticeForm& form, const std::string& label, const RunControl& control);

}  // namespace fieldtrue::exporters
