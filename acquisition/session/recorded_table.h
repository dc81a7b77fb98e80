#pragma once

#include <QString>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// The node table of a session (`*.fieldtrue`), or of a file that is one.
/// @error as SessionStore::open and readNodeTable; kTooFewNodes for a session without a recorded place
Result<CalibrationTable> recordedTable(const QString& path);

}  // namespace fieldtrue::acquisition
