#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace grid_scale {
namespace {

constexpr double kPlausible = 0.1;

void perAxisResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Vector3d q_m = inverse(setting.tracker_from_reference) * setting.tracker_from_sensor.position_m;
  const Eigen::Matrix3d R = setting.tracker_from_reference.orientation.toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) {
    responses[static_cast<std::size_t>(axis)].shift_m = R.col(axis) * q_m[axis];
  }
}

void isotropicResponse(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  responses[0].shift_m = setting.tracker_from_sensor.position_m - setting.tracker_from_reference.position_m;
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return linearEffect(perAxisResponses, vectorOf(parameters, "scale"));
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& /*design*/) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(linearFit(
      {"isotropic", {{"scale", "", -kPlausible, kPlausible}}, isotropicResponse, [](const Eigen::VectorXd& s) {
         return nlohmann::json{{"scale", listOf(Eigen::Vector3d::Constant(s[0]))}};
       }}));
  ways.push_back(
      linearFit({"per_axis", vectorParameters("scale", "", kPlausible), perAxisResponses, [](const Eigen::VectorXd& s) {
                   return nlohmann::json{{"scale", listOf(s.head<3>())}};
                 }}));
  return ways;
}

}  // namespace
}  // namespace grid_scale

/// A rig that is larger or smaller than its drawing, along each of its axes: wrong pitch, wet wood, a tape in another
/// unit.
///
/// Convention: a sensor that the rig says to be at q (rig's frame) is really at (1 + diag(s)) q. Which point stays in
/// place does not matter where the alignment is unknown; here it is the rig's origin.
/// @source geometry, by hand
Effect gridScaleEffect() {
  using namespace grid_scale;
  Effect effect;
  effect.id = "grid_scale";
  effect.label = "Scale of the rig";
  effect.source = "Geometry";
  effect.parameters = {declare::vector3("scale", {-100.0, 100.0}, {0.0, 0.0, 0.0},
                                        "How much longer the rig is than it says along its own x, y, z: 0.01 is 1 %.")
                           .plausibly(-kPlausible, kPlausible)};
  effect.make = make;
  effect.fits = fits;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
