// To add an effect:
// 1. Write calib/effects/<id>.cpp: a PhysicalEffect (a CouplingDistortion where it is metal in the room), and a
//    function that returns its Effect row, declared in rows.h. Its comment states formula, convention and source.
// 2. Give every parameter a name that ends in its unit, a shape, a range, a default, one sentence of help and, where
//    one is known, the range met in practice. `make` receives them resolved; it only refuses what makes no sense
//    together.
// 3. Say in `admits` where a sensor cannot be.
// 4. Write `fits` (effect_fit.h): the ways it is looked for in a recording. Where nothing is searched, linear_fit.h
//    makes both the effect and its ways from one function. Null where only the raw samples show it.
// 5. Add the row to the table below and its defaults to resources/scenes/example.scene.json. Scenes, command line,
//    diagnosis, reports and the contract tests (tests/calib/effects/effect_registry_test.cpp,
//    effect_fit_contract_test.cpp) loop over it.
// 6. Test the physics in tests/calib/effects/<id>_test.cpp against a boundary condition, a limit or a published
//    figure.

#include "calib/effects/registry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/nearest_name.h"
#include "calib/effects/closed_loop.h"
#include "calib/effects/compact_metal.h"
#include "calib/effects/effect_row.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace {

bool isBounded(const EffectParameter& parameter) { return parameter.min != 0.0 || parameter.max != 0.0; }

/// Numbers of a list.
constexpr std::size_t kLongestList = 64;

bool isComponent(const EffectParameter& parameter, const nlohmann::json& value) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return false;
  const double number = value.get<double>();
  return !isBounded(parameter) || (number >= parameter.min && number <= parameter.max);
}

bool areComponents(const EffectParameter& parameter, const nlohmann::json& value, std::size_t count) {
  return value.is_array() && value.size() == count &&
         std::all_of(value.begin(), value.end(), [&](const nlohmann::json& x) { return isComponent(parameter, x); });
}

/// Three rows of three written one after the other; anything else as it is.
nlohmann::json flattened(const nlohmann::json& value) {
  const bool has_rows =
      value.is_array() && value.size() == 3 &&
      std::all_of(value.begin(), value.end(), [](const nlohmann::json& row) { return row.is_array(); });
  if (!has_rows) return value;
  nlohmann::json flat = nlohmann::json::array();
  for (const nlohmann::json& row : value) flat.insert(flat.end(), row.begin(), row.end());
  return flat;
}

/// Reciprocity makes every polarizability symmetric; figures rounded to six digits still pass.
bool isSymmetric(const nlohmann::json& flat) {
  double largest = 0.0;
  for (const nlohmann::json& x : flat) largest = std::max(largest, std::abs(x.get<double>()));
  const auto differs = [&](std::size_t a, std::size_t b) {
    return std::abs(flat[a].get<double>() - flat[b].get<double>()) > 1e-6 * largest;
  };
  return !differs(1, 3) && !differs(2, 6) && !differs(5, 7);
}

bool hasShape(const EffectParameter& parameter, const nlohmann::json& value) {
  if (value.is_null()) return parameter.default_value.is_null();
  if (parameter.shape == "scalar") return isComponent(parameter, value);
  if (parameter.shape == "vector3") return areComponents(parameter, value, 3);
  if (parameter.shape == "matrix3") return areComponents(parameter, value, 9) && isSymmetric(value);
  if (parameter.shape == "list") {
    return !value.empty() && value.size() <= kLongestList && areComponents(parameter, value, value.size());
  }
  FT_CHECK(parameter.shape == "text");
  if (!value.is_string()) return false;
  const auto& choices = parameter.choices;
  return choices.empty() || std::find(choices.begin(), choices.end(), value.get<std::string>()) != choices.end();
}

std::string needed(const EffectParameter& parameter) {
  std::string text;
  if (parameter.shape == "text") {
    for (const std::string& choice : parameter.choices) text += (text.empty() ? "\"" : " or \"") + choice + "\"";
    return text.empty() ? "a text" : text;
  }
  text = "a number";
  if (parameter.shape == "vector3") text = "three numbers";
  if (parameter.shape == "matrix3") text = "nine numbers of a symmetric matrix, row by row,";
  if (parameter.shape == "list") text = "a list of 1 to " + std::to_string(kLongestList) + " numbers";
  if (isBounded(parameter)) text += " from " + formatNumber(parameter.min) + " to " + formatNumber(parameter.max);
  if (!parameter.unit.empty()) text += " [" + parameter.unit + "]";
  return text;
}

nlohmann::json toJson(const EffectParameter& parameter) {
  nlohmann::json json{{"name", parameter.name},   {"unit", parameter.unit},
                      {"shape", parameter.shape}, {"default", parameter.default_value},
                      {"min", nullptr},           {"max", nullptr},
                      {"plausible_min", nullptr}, {"plausible_max", nullptr},
                      {"help", parameter.help},   {"choices", parameter.choices}};
  if (isBounded(parameter)) {
    json["min"] = parameter.min;
    json["max"] = parameter.max;
  }
  if (parameter.plausible_min != 0.0 || parameter.plausible_max != 0.0) {
    json["plausible_min"] = parameter.plausible_min;
    json["plausible_max"] = parameter.plausible_max;
  }
  return json;
}

}  // namespace

std::span<const Effect> effects() {
  static const std::array kEffects{compactMetalEffect(),   metalPlaneEffect(),
                                   closedLoopEffect(),     finiteCoilEffect(),
                                   finitePlateEffect(),    metalMovedEffect(),
                                   coilGainEffect(),       coilNonorthogonalityEffect(),
                                   globalGainEffect(),     gridScaleEffect(),
                                   jigLayerOffsetEffect(), jigTiltEffect(),
                                   sensorOffsetEffect(),   transmitterMisalignmentEffect(),
                                   gainDriftEffect(),      mainsInterferenceEffect(),
                                   rangeNoiseEffect(),     correlatedSamplesEffect(),
                                   quantizationEffect(),   hemisphereFlipEffect()};
  return kEffects;
}

Result<const Effect*> findEffect(std::string_view id) {
  std::vector<std::string> known;
  for (const Effect& effect : effects()) {
    if (effect.id == id) return &effect;
    known.push_back(effect.id);
  }
  return fail(ErrorCode::kBadInput, "Effect " + unknownName(id, known));
}

std::string labelOf(const std::string& id) {
  const auto effect = findEffect(id);
  return effect ? (*effect)->label : id;
}

Result<nlohmann::json> resolveEffectParameters(const Effect& effect, const nlohmann::json& given) {
  if (given.is_null()) return resolveEffectParameters(effect, nlohmann::json::object());
  if (!given.is_object()) {
    return fail(ErrorCode::kBadInput,
                effect.id + ": its parameters are " + seenValue(given) + "; they must be an object {...}.");
  }
  std::vector<std::string> known;
  nlohmann::json resolved = nlohmann::json::object();
  for (const EffectParameter& parameter : effect.parameters) {
    known.push_back(parameter.name);
    const auto found = given.find(parameter.name);
    const nlohmann::json& seen = found == given.end() ? parameter.default_value : *found;
    nlohmann::json value = parameter.shape == "matrix3" ? flattened(seen) : seen;
    if (!hasShape(parameter, value)) {
      return fail(ErrorCode::kBadInput, effect.id + ": " + parameter.name + " is " + seenValue(seen) + "; it must be " +
                                            needed(parameter) + ".");
    }
    resolved[parameter.name] = std::move(value);
  }
  for (const auto& [key, unused] : given.items()) {
    if (key != "comment" && std::find(known.begin(), known.end(), key) == known.end()) {
      return fail(ErrorCode::kBadInput, effect.id + ": parameter " + unknownName(key, known));
    }
  }
  return resolved;
}

Result<std::unique_ptr<field::PhysicalEffect>> makeEffect(std::string_view id, const nlohmann::json& given,
                                                          const field::Excitation& excitation) {
  const Result<const Effect*> effect = findEffect(id);
  if (!effect) return tl::unexpected<Error>(effect.error());
  const Result<nlohmann::json> parameters = resolveEffectParameters(**effect, given);
  if (!parameters) return tl::unexpected<Error>(parameters.error());
  return (*effect)->make(*parameters, excitation);
}

nlohmann::json toJson(std::span<const Effect> rows) {
  nlohmann::json list = nlohmann::json::array();
  for (const Effect& effect : rows) {
    nlohmann::json parameters = nlohmann::json::array();
    for (const EffectParameter& parameter : effect.parameters) parameters.push_back(toJson(parameter));
    list.push_back({{"id", effect.id}, {"label", effect.label}, {"source", effect.source}, {"parameters", parameters}});
  }
  return list;
}

}  // namespace fieldtrue::effects
