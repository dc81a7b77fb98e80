#include "calib/effects/grid_scale.h"

#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

constexpr double kPlausible = 0.1;

void perAxisResponses(const SensorSetting& setting, std::span<EffectResponse> responses) {
  const Eigen::Vector3d q_m = inverse(setting.tracker_from_reference) * setting.tracker_from_sensor.position_m;
  const Eigen::Matrix3d R = setting.tracker_from_reference.orientation.toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) {
    responses[static_cast<std::size_t>(axis)].shift_m = R.col(axis) * q_m[axis];
  }
}

void isotropicResponse(const SensorSetting& setting, std::span<EffectResponse> responses) {
  responses[0].shift_m = setting.tracker_from_sensor.position_m - setting.tracker_from_reference.position_m;
}

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
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

Effect gridScaleEffect() {
  Effect effect;
  effect.id = "grid_scale";
  effect.label = "Scale of the rig";
  effect.source = "Geometry";
  effect.parameters = {{"scale",
                        "",
                        "vector3",
                        {0.0, 0.0, 0.0},
                        -100.0,
                        100.0,
                        "How much longer the rig is than it says along its own x, y, z: 0.01 is 1 %.",
                        {},
                        -kPlausible,
                        kPlausible}};
  effect.make = make;
  effect.fits = fits;
  return effect;
}

}  // namespace fieldtrue
