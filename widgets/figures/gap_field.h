#pragma once

#include "calib/core/calibration_table.h"
#include "calib/gap/report.h"
#include "widgets/figures/error_field.h"

namespace fieldtrue::widgets {

/// The gap at every place as arrows in the rig's frame, with the bodies it is put down to. @param after with the
/// selected effects in the simulation
/// @param table the rows diagnosed, whose places are drawn; null = as near as the report tells them
ErrorField gapField(const gap::GapReport& report, bool after, const CalibrationTable* table = nullptr);

}  // namespace fieldtrue::widgets
