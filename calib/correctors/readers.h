#pragma once

#include <string_view>

#include "calib/core/error.h"
#include "calib/correctors/base/readers.h"

namespace fieldtrue::correctors {

/// The reader of a method's stored parameters. @error kBadInput naming the known ids
Result<ModelReader<PositionModel>> findPositionReader(std::string_view id);
Result<ModelReader<OrientationModel>> findOrientationReader(std::string_view id);

}  // namespace fieldtrue::correctors
