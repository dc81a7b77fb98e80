#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// The metadata as a JSON object; what is not set is absent.
nlohmann::json toJson(const TableMetadata& metadata);

/// The inverse of toJson; members of the wrong type are left unset.
TableMetadata metadataFromJson(const nlohmann::json& json);

/// Fills what `known` leaves unset from `more`, entry by entry of `other` too.
TableMetadata merged(TableMetadata known, const TableMetadata& more);

}  // namespace fieldtrue::acquisition
