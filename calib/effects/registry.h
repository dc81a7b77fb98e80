#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"
#include "calib/field/coupling.h"

namespace fieldtrue {

/// One parameter of an effect, as data.
struct EffectParameter {
  std::string name;  ///< With its unit: `center_m`.
  std::string unit;
  std::string shape;             ///< "scalar", "vector3", "matrix3" (row-major, symmetric), "text".
  nlohmann::json default_value;  ///< Null = not given; null is then also accepted in a file.
  double min = 0.0;              ///< Of each component; 0 and 0 = not bounded.
  double max = 0.0;
  std::string help;
  std::vector<std::string> choices = {};  ///< Of a text; empty = any.
};

/// One row of the effect registry.
struct Effect {
  std::string id;
  std::string label;
  std::string source;
  std::vector<EffectParameter> parameters;
  /// Builds the distortion from resolved parameters. @error kBadInput for parameters that make no sense together
  Result<std::unique_ptr<CouplingDistortion>> (*make)(const nlohmann::json& parameters) = nullptr;
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
Result<std::unique_ptr<CouplingDistortion>> makeDistortion(std::string_view id, const nlohmann::json& given);
nlohmann::json toJson(std::span<const Effect> effects);

}  // namespace fieldtrue
