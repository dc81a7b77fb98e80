#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace global_gain {
namespace {

constexpr double kPlausible = 0.1;

void responses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  responses[0].field_per_m3 = field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
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
}  // namespace global_gain

/// Everything is received stronger or weaker by one factor: a wrong dipole constant, drive current or unit.
///
/// Convention: dG = g G. The range follows G ~ r^-3, so a sensor at p is reported at p (1 + g)^(-1/3) = p (1 - g/3) to
/// first order; the orientation stays. An isotropic error of the rig's scale looks the same about the transmitter.
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (inverse cube law)
Effect globalGainEffect() {
  using namespace global_gain;
  Effect effect;
  effect.id = "global_gain";
  effect.label = "Gain of the whole tracker";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709";
  effect.parameters = {
      declare::number("gain", {-0.999, 1e3}, 0.0,
                      "Relative error of every coupling; 0.03 brings every reading 1 % nearer to the transmitter.")
          .plausibly(-kPlausible, kPlausible)};
  effect.make = make;
  effect.fits = fits;
  return effect;
}

}  // namespace fieldtrue::effects
