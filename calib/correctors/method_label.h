#pragma once

#include <string>

#include "calib/core/settings.h"

namespace fieldtrue::correctors {

/// A method as people read it everywhere: "Polynomial", or "Polynomial (degree 4)" where settings differ from their
/// defaults. The id itself when no registry has it.
std::string positionLabel(const std::string& id, const Settings& settings = {});
std::string orientationLabel(const std::string& id, const Settings& settings = {});

}  // namespace fieldtrue::correctors
