#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/gap/report.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::widgets {

/// What a session keeps of its diagnosis, so that the page opens where it was.
struct KeptGap {
  std::optional<simulation::Scene> scene;                 ///< What the simulator believes; none = an ideal tracker.
  std::vector<std::optional<simulation::Scene>> earlier;  ///< What undo goes back to, the oldest first.
  std::optional<gap::GapReport> report;
};

/// @param table the rows that the report is of
std::string toText(const KeptGap& kept, const CalibrationTable& table);

/// The inverse. @return without the report where it is of other rows than the table's. @error kBadInput, kNewerVersion
Result<KeptGap> readKeptGap(const std::string& text, const CalibrationTable& table, const std::string& name);

}  // namespace fieldtrue::widgets
