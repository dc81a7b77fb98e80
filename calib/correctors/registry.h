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

/// Fits that leave rows out, from one factorisation of the fit to all rows. The methods that can are linear in their
/// true values; settings chosen from the data stay as all rows chose them.
template <class Model>
class HoldOutFits {
 public:
  virtual ~HoldOutFits() = default;

  /// The model that a fit to all rows but these gives.
  /// @param rows of the fit data, ascending
  /// @param fold_from_data rigid change of the true positions: the fit is to fold_from_data * p_true_m, in which the
  ///        alignment was found without the rows left out
  /// @error kDegenerate when the rest does not determine the method
  virtual Result<std::unique_ptr<Model>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const = 0;
};

/// One row of a method registry. `fit` returns an error when the data does not determine the method.
template <class Model>
struct CorrectionMethod {
  std::string id;
  std::string label;
  std::string source;  ///< Author, year, section and equation.
  std::vector<Setting> settings;
  Result<std::unique_ptr<Model>> (*fit)(const FitData&, const Settings&, const RunControl&) = nullptr;
  Result<std::unique_ptr<Model>> (*load)(const nlohmann::json& parameters) = nullptr;
  /// Fits with rows left out, without fitting anew; null where the method has no closed form.
  Result<std::unique_ptr<HoldOutFits<Model>>> (*hold_out)(const FitData&, const Settings&, const RunControl&) = nullptr;
  int most_folds =
      0;  ///< A comparison refits a costly method at most so often, over larger folds; 0 = as often as asked.
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
