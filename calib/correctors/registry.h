#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/core/settings.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/orientation_model.h"
#include "calib/correctors/base/position_model.h"

namespace fieldtrue::correctors {

/// Every method, in the order menus show them.
std::span<const PositionMethod> positionMethods();
std::span<const OrientationMethod> orientationMethods();

/// The row of an id; of `imported` too, which is read and never fitted, and so stands in no list. @error kBadInput
/// naming the known ids
Result<const PositionMethod*> findPositionMethod(std::string_view id);
Result<const OrientationMethod*> findOrientationMethod(std::string_view id);

}  // namespace fieldtrue::correctors
