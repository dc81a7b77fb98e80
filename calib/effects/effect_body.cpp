#include "calib/effects/effect_body.h"

#include <nlohmann/json.hpp>
#include <optional>

namespace fieldtrue::effects {
namespace {

std::optional<Eigen::Vector3d> directionIn(const nlohmann::json& parameters, const char* key) {
  if (!parameters.is_object() || !parameters.contains(key) || !parameters[key].is_array()) return std::nullopt;
  const Eigen::Vector3d v(parameters[key][0], parameters[key][1], parameters[key][2]);
  return v.norm() > 0.0 ? std::optional<Eigen::Vector3d>(v.normalized()) : std::nullopt;
}

double lengthIn(const nlohmann::json& parameters, const char* key) {
  if (!parameters.is_object() || !parameters.contains(key) || !parameters[key].is_number()) return 0.0;
  return parameters[key];
}

}  // namespace

EffectBody ballOf(const nlohmann::json& parameters) { return {.radius_m = lengthIn(parameters, "radius_m")}; }

EffectBody planeOf(const nlohmann::json& parameters) {
  EffectBody body{.shape = DrawnShape::kPlane};
  if (const auto toward = directionIn(parameters, "toward")) body.normal = *toward;
  return body;
}

EffectBody plateOf(const nlohmann::json& parameters) {
  EffectBody body{.shape = DrawnShape::kPlate};
  if (const auto normal = directionIn(parameters, "normal")) body.normal = *normal;
  if (const auto side = directionIn(parameters, "side"))
    body.side = (*side - side->dot(body.normal) * body.normal).normalized();
  body.length_m = lengthIn(parameters, "length_m");
  body.width_m = lengthIn(parameters, "width_m");
  return body;
}

EffectBody loopOf(const nlohmann::json& parameters) {
  EffectBody body{.shape = DrawnShape::kLoop, .radius_m = lengthIn(parameters, "radius_m")};
  if (const auto normal = directionIn(parameters, "normal")) body.normal = *normal;
  return body;
}

}  // namespace fieldtrue::effects
