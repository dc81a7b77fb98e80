#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"
#include "calib/effects/effect_fit.h"
#include "calib/field/coupling.h"
#include "calib/field/effect.h"

namespace fieldtrue {

/// One parameter of an effect, as data.
struct EffectParameter {
  std::string name;  ///< With its unit: `center_m`.
  std::string unit;
  std::string shape;             ///< "scalar", "vector3", "matrix3" (row-major, symmetric), "text", "list".
  nlohmann::json default_value;  ///< Null = not given; null is then also accepted in a file.
  double min = 0.0;              ///< Of each component; 0 and 0 = not bounded.
  double max = 0.0;
  std::string help;
  std::vector<std::string> choices = {};  ///< Of a text; empty = any.
  double plausible_min = 0.0;             ///< Of each component: what is met in practice; 0 and 0 = not told.
  double plausible_max = 0.0;
};

/// One row of the effect registry.
struct Effect {
  std::string id;
  std::string label;
  std::string source;
  std::vector<EffectParameter> parameters;
  /// Builds the effect from resolved parameters. @error kBadInput for parameters that make no sense together
  Result<std::unique_ptr<PhysicalEffect>> (*make)(const nlohmann::json& parameters,
                                                  const Excitation& excitation) = nullptr;
  /// The ways to fit it to a table of this design, simplest first; null for what only samples show. A way whose
  /// parameters the design cannot show at all (time without times, a lever arm with one orientation) is left out.
  std::vector<std::unique_ptr<EffectFit>> (*fits)(const FitDesign& design) = nullptr;
};

std::span<const Effect> effects();
/// @error kBadInput naming the known ids
Result<const Effect*> findEffect(std::string_view id);
/// Fills defaults (null = all of them) and checks names, shapes and ranges. The key `comment` is dropped; a matrix3 may
/// also be given as three rows of three.
/// @error kBadInput naming the effect, the parameter, what was seen and what is needed
Result<nlohmann::json> resolveEffectParameters(const Effect& effect, const nlohmann::json& given);
/// Finds, resolves and builds.
/// @error kBadInput as the steps it takes
Result<std::unique_ptr<PhysicalEffect>> makeEffect(std::string_view id, const nlohmann::json& given,
                                                   const Excitation& excitation = {});
nlohmann::json toJson(std::span<const Effect> effects);

}  // namespace fieldtrue
