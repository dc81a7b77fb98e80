#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"
#include "calib/effects/effect_fit.h"
#include "calib/effects/effect_row.h"
#include "calib/field/dipole_field.h"
#include "calib/field/effect.h"

namespace fieldtrue::effects {

std::span<const Effect> effects();
/// @error kBadInput naming the known ids
Result<const Effect*> findEffect(std::string_view id);
/// "Metal floor, wall or ceiling" for `metal_plane`; the id itself where there is no such row.
std::string labelOf(const std::string& id);
/// "scalar", "vector3", "matrix3" (row-major, symmetric), "text" or "list": a parameter's type as listings name it.
const char* shapeOf(const Setting& parameter);
/// Fills defaults (null = all of them) and checks names, shapes and ranges. The key `comment` is dropped; a matrix3 may
/// also be given as three rows of three.
/// @error kBadInput naming the effect, the parameter, what was seen and what is needed
Result<nlohmann::json> resolveEffectParameters(const Effect& effect, const nlohmann::json& given);
/// Finds, resolves and builds.
/// @error kBadInput as the steps it takes
Result<std::unique_ptr<field::PhysicalEffect>> makeEffect(std::string_view id, const nlohmann::json& given,
                                                          const field::Excitation& excitation = {});
nlohmann::json toJson(std::span<const Effect> effects);

}  // namespace fieldtrue::effects
