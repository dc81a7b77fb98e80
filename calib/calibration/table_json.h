#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calib/core/calibration_table.h"

namespace fieldtrue::calibration {

/// A node table as JSON: {"metadata": {...}, "nodes": [{...}]} with the names and units of the node table's columns;
/// what is not stated is absent.
nlohmann::json tableToJson(const CalibrationTable& table);

/// The inverse, to the same bits. Throws nlohmann::json::exception for other JSON: call inside `guarded`.
CalibrationTable tableFromJson(const nlohmann::json& json);

}  // namespace fieldtrue::calibration
