#pragma once

#include <string>

#include "calib/core/settings.h"

namespace fieldtrue::correctors {

/// A method as a person writes it: `id` or `id:key=value,key=value`; parseMethodText reads it back.
std::string methodText(const std::string& id, const Settings& settings);

}  // namespace fieldtrue::correctors
