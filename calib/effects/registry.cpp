// To add an effect:
// 1. Write calib/effects/<id>.cpp: a PhysicalEffect (a CouplingDistortion where it is metal in the room), and a
//    function that returns its Effect row, declared in rows.h. Its comment states formula, convention and source.
// 2. Declare every parameter (declare.h) with a key that ends in its unit, a range, a default, one sentence of help
//    and, where one is known, the range met in practice. `make` receives them resolved; it only refuses what makes no
//    sense together.
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

nlohmann::json toJson(const Setting& parameter) {
  nlohmann::json json{{"name", parameter.key},
                      {"unit", parameter.unit},
                      {"shape", shapeOf(parameter)},
                      {"default", fieldtrue::toJson(parameter.default_value)},
                      {"min", nullptr},
                      {"max", nullptr},
                      {"plausible_min", nullptr},
                      {"plausible_max", nullptr},
                      {"help", parameter.help},
                      {"choices", parameter.choices}};
  if (parameter.isBounded()) {
    json["min"] = parameter.min;
    json["max"] = parameter.max;
  }
  if (parameter.hasPlausibleRange()) {
    json["plausible_min"] = parameter.plausible_min;
    json["plausible_max"] = parameter.plausible_max;
  }
  return json;
}

}  // namespace

const char* shapeOf(const Setting& parameter) {
  switch (parameter.type) {
    case SettingType::kChoice:
      return "text";
    case SettingType::kVector3:
      return "vector3";
    case SettingType::kMatrix3:
      return "matrix3";
    case SettingType::kNumbers:
      return "list";
    default:
      return "scalar";
  }
}

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
  for (const Setting& parameter : effect.parameters) {
    known.push_back(parameter.key);
    const auto found = given.find(parameter.key);
    const nlohmann::json seen = found == given.end() ? fieldtrue::toJson(parameter.default_value) : *found;
    nlohmann::json value = parameter.type == SettingType::kMatrix3 ? flattened(seen) : seen;
    if (!accepts(parameter, value)) {
      return fail(ErrorCode::kBadInput, effect.id + ": " + parameter.key + " is " + seenValue(seen) + "; it must be " +
                                            neededFor(parameter) + ".");
    }
    resolved[parameter.key] = std::move(value);
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
  FT_TRY(const Effect* effect, findEffect(id));
  FT_TRY(const nlohmann::json parameters, resolveEffectParameters(*effect, given));
  return effect->make(parameters, excitation);
}

nlohmann::json toJson(std::span<const Effect> rows) {
  nlohmann::json list = nlohmann::json::array();
  for (const Effect& effect : rows) {
    nlohmann::json parameters = nlohmann::json::array();
    for (const Setting& parameter : effect.parameters) parameters.push_back(toJson(parameter));
    list.push_back({{"id", effect.id}, {"label", effect.label}, {"source", effect.source}, {"parameters", parameters}});
  }
  return list;
}

}  // namespace fieldtrue::effects
