#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue {

/// The sensors with rows that count (skipped ones do not), in order.
std::vector<int> sensorsOf(const CalibrationTable& table);
std::vector<int> sensorsOf(std::span<const Node> nodes);

/// "sensor 0" or "sensors 0, 1 and 2".
std::string sensorsText(const std::vector<int>& sensors);

/// Those of one sensor, in their order.
std::vector<Node> nodesOfSensor(std::span<const Node> nodes, int sensor);

/// The rows of one sensor, since each has a mounting of its own; of the only one where none is chosen.
/// @error kBadInput naming the sensors when there are several and none is chosen, or the chosen one has no row
Result<CalibrationTable> rowsOfSensor(const CalibrationTable& table, std::optional<int> sensor);
SampleTable rowsOfSensor(const SampleTable& table, int sensor);

}  // namespace fieldtrue
