#pragma once

#include <vector>

#include "calib/correctors/base/fit_data.h"

namespace fieldtrue::correctors {

/// The rows of fit data that are wanted. @param rows ascending
FitData rowsOfFitData(const FitData& data, const std::vector<std::size_t>& rows);

}  // namespace fieldtrue::correctors
