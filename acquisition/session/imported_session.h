#pragma once

#include <QString>
#include <optional>
#include <string>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// Makes a session of another program's recording: its places are the plan, in the order of the table, every one taken.
/// Rows of several sensors at one place and visit get visits of their own, for a session has one take for each.
/// @param samples those of the rows, where they are known; the ones of no row are kept as readings between the places
/// @param source stands among the session's events
/// @error kIo (exists already, disk full); kBadInput for what no plan can hold: nothing is left behind
Result<void> makeSession(const QString& path, const CalibrationTable& table, const std::optional<SampleTable>& samples,
                         const std::string& source);

}  // namespace fieldtrue::acquisition
