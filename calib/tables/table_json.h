#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calib/core/calibration_table.h"
#include "calib/core/json_reader.h"

namespace fieldtrue {

/// What is stated of a table, with the keys of its files.
nlohmann::json toJson(const TableMetadata& metadata);
TableMetadata metadataFrom(const JsonReader& json);

/// Of an object with the facts' keys; null is not stated, and so is what is missing.
Setup setupFrom(const JsonReader& json);

/// A node table as JSON: {"metadata": {...}, "nodes": [{...}]} with the names and units of the node table's columns;
/// what is not stated is absent.
nlohmann::json toJson(const CalibrationTable& table);
/// The inverse, to the same bits.
CalibrationTable tableFrom(const JsonReader& json);

}  // namespace fieldtrue
