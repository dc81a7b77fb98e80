#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/core/settings.h"
#include "calib/correctors/fit_data.h"
#include "calib/correctors/orientation_model.h"
#include "calib/correctors/position_model.h"

namespace fieldtrue {

/// One row of a method registry. `fit` returns an error when the data does not determine the method.
template <class Model>
struct CorrectionMethod {
  std::string id;
  std::string label;
  std::string source;  ///< Author, year, section and equation.
  std::vector<Setting> settings;
  Result<std::unique_ptr<Model>> (*fit)(const FitData&, const Settings&, const RunControl&) = nullptr;
  Result<std::unique_ptr<Model>> (*load)(const nlohmann::json& parameters) = nullptr;
};
using PositionMethod = CorrectionMethod<PositionModel>;
using OrientationMethod = CorrectionMethod<OrientationModel>;

/// Every method, in the order menus show them.
std::span<const PositionMethod> positionMethods();
std::span<const OrientationMethod> orientationMethods();

/// The row of an id. @error kBadInput naming the known ids
Result<const PositionMethod*> findPositionMethod(std::string_view id);
Result<const OrientationMethod*> findOrientationMethod(std::string_view id);

}  // namespace fieldtrue
