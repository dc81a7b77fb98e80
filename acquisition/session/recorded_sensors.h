#pragma once

#include <string>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// Under this name a session keeps which sensors a person chose to record (SessionStore::state).
inline constexpr const char* kSensorsState = "sensors";

/// "1", or "0+2" of which the first leads; "all" and nothing at all are every sensor that reports: empty.
/// @error kBadInput: what it may be
Result<std::vector<int>> readSensors(const std::string& text);
/// As readSensors reads it.
std::string textOf(const std::vector<int>& sensors);

}  // namespace fieldtrue::acquisition
