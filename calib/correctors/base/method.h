#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/json_reader.h"
#include "calib/core/run_control.h"
#include "calib/core/settings.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/base/orientation_model.h"
#include "calib/correctors/base/position_model.h"

namespace fieldtrue::correctors {

/// Fits that leave rows out, taken off the fit to all rows instead of made anew. The methods that can are linear in
/// their true values; settings chosen from the data stay as all rows chose them.
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

  /// How much the fit itself varies with the places of its table: variance of the logarithm of the mean square that it
  /// leaves at fresh places, from table to table. 0 where the form does not tell.
  virtual double ownVariance() const { return 0.0; }
};

/// Where a method comes from. Baselines are looked at beside all others.
enum class MethodOrigin { kBaseline, kSurvey, kLater };

/// Ranks in simplicity, above none, rigid, affine and polynomials of degree 2 and 3 (0 to 4). Physical and smoothing
/// fits are alike in it, and so are polynomials of a higher degree, whose terms are half as many as the places of a
/// small table and run away beyond them: which errs less decides.
namespace simplicity {
inline constexpr int kPhysical = 10;       ///< Fields that obey the physics.
inline constexpr int kSmoothing = 10;      ///< Smoothing fits that follow any field.
inline constexpr int kInterpolating = 20;  ///< What passes through every place.
}  // namespace simplicity

/// What one fit takes beside those of other methods.
enum class FitCost {
  kLight,
  kCostly,     ///< Places are held out in ten folds at most, never one by one.
  kVeryCostly  ///< The same, and the window compares it only when asked.
};

/// Whether a fit chooses from the true positions what is not determined by them alone: settings, scales, members.
enum class Tuning {
  kBySettings,  ///< Where one of its auto-numbers, among those that count, is left to it.
  kNever,
  kAlways
};

/// Settings with which the automatic choice tries a method.
struct AutomaticTry {
  std::string settings;  ///< As after the colon of a method's text; empty = the defaults.
  int rank = 0;          ///< Among equally good ones the lowest is chosen.
};

/// One row of a method registry.
template <class Model>
struct CorrectionMethod {
  std::string id;
  std::string label;
  std::string source;  ///< Author, year, section and equation.
  std::vector<Setting> settings;
  /// @error when the data does not determine the method
  Result<std::unique_ptr<Model>> (*fit)(const FitData&, const Settings&, const RunControl&) = nullptr;
  /// The model that stored parameters describe; throws as a JsonReader does.
  std::unique_ptr<Model> (*read)(const JsonReader& parameters) = nullptr;
  /// Fits with rows left out, without fitting anew; null where the method has no closed form.
  Result<std::unique_ptr<HoldOutFits<Model>>> (*hold_out)(const FitData&, const Settings&, const RunControl&) = nullptr;
  /// Whether hold_out has a form for such data; null = for any.
  bool (*holds_out)(const FitData&, const Settings&) = nullptr;
  /// The fits of hold_out keep lengths and weights that all rows gave, even with every setting told: only near to fits
  /// anew, so they stand where what all rows chose is kept anyway.
  bool keeps_scales = false;
  FitCost cost = FitCost::kLight;
  Tuning tuning = Tuning::kBySettings;
  MethodOrigin origin = MethodOrigin::kSurvey;
  /// What the automatic choice tries of it; empty = nothing.
  std::vector<AutomaticTry> tries = {};
  /// How the source is read where a sentence of it leaves more than one way; empty where none does.
  std::string reading = {};
  /// Whether a fit with such settings looks at that auto-number at all; null = at every one.
  bool (*uses)(const Settings&, const std::string& key) = nullptr;
  /// Settings that earlier versions stored in calibrations and that change nothing any more.
  std::vector<std::string> former_settings = {};

  /// Whether hold_out gives what fits anew would.
  bool holdsOutExactly(const Settings& given) const { return hold_out != nullptr && !keeps_scales && !tunes(given); }

  bool canHoldOut(const FitData& data, const Settings& given) const {
    return hold_out != nullptr && (holds_out == nullptr || holds_out(data, given));
  }

  bool isCostly() const { return cost != FitCost::kLight; }

  /// Whether a fit with these settings is tuned by its data, so that only a fit without a place can be judged at it.
  bool tunes(const Settings& given) const {
    if (tuning != Tuning::kBySettings) return tuning == Tuning::kAlways;
    return std::any_of(settings.begin(), settings.end(), [&](const Setting& setting) {
      const auto value = given.find(setting.key);
      return setting.type == SettingType::kAutoNumber && value != given.end() &&
             std::holds_alternative<std::string>(value->second) && (uses == nullptr || uses(given, setting.key));
    });
  }

  /// @error kBadInput when the JSON is not what the method stores
  Result<std::unique_ptr<Model>> load(const nlohmann::json& parameters) const {
    return readJson<std::unique_ptr<Model>>(parameters, "parameters of " + id, read);
  }
};
using PositionMethod = CorrectionMethod<PositionModel>;
using OrientationMethod = CorrectionMethod<OrientationModel>;

}  // namespace fieldtrue::correctors
