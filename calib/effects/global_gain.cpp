#include "calib/effects/global_gain.h"

#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

constexpr double kPlausible = 0.1;

void responses(const SensorSetting& setting, std::span<EffectResponse> responses) {
  responses[0].field_per_m3 = dipoleField(setting.tracker_from_sensor.position_m, 1.0);
}

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  return linearEffect(responses, Eigen::VectorXd::Constant(1, scalarOf(parameters, "gain")));
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& /*design*/) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(linearFit({"gain", {{"gain", "", -kPlausible, kPlausible}}, responses, [](const Eigen::VectorXd& g) {
                              return nlohmann::json{{"gain", g[0]}};
                            }}));
  return ways;
}

}  // namespace

Effect globalGainEffect() {
  Effect effect;
  effect.id = "global_gain";
  effect.label = "Gain of the whole tracker";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709";
  effect.parameters = {{"gain",
                        "",
                        "scalar",
                        0.0,
                        -0.999,
                        1e3,
                        "Relative error of every coupling; 0.03 brings every reading 1 % nearer to the transmitter.",
                        {},
                        -kPlausible,
                        kPlausible}};
  effect.make = make;
  effect.fits = fits;
  return effect;
}

}  // namespace fieldtrue
