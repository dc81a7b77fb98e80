#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace range_noise {
namespace {

constexpr double kSds = 3.0;
/// Powers and levels nearer the expected ones than this are a solver's own way.
constexpr double kPowerMargin = 0.35;
constexpr double kLevelMargin = 0.3;
constexpr double kAnisotropyMargin = 0.5;

class RangeNoise final : public field::PhysicalEffect {
 public:
  RangeNoise(double factor, double power) : factor_(factor), power_(power) {}
  void disturb(field::SignalModel& signal) const override {
    signal.noise_factor *= factor_;
    signal.noise_range_power += power_;
  }

 private:
  double factor_;
  double power_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return std::make_unique<RangeNoise>(scalarOf(parameters, "factor"), scalarOf(parameters, "power"));
}

bool differs(const recording::Uncertain& seen, double expected, double margin) {
  return std::abs(seen.value - expected) > margin + kSds * seen.sd;
}

std::string powerText(const recording::NoiseLaw& law, double expected) {
  std::string text =
      formatted("The noise of a reading grows as range to the power %.1f +- %.1f between %.2f and %.2f m",
                law.position_power.value, law.position_power.sd, law.nearest_m, law.farthest_m);
  text += formatted(" where a least-squares tracker's grows as power %.2g", expected);
  if (law.rotation_power) {
    text += formatted(" (rotation: %.1f +- %.1f, expected %.2g)", law.rotation_power->value, law.rotation_power->sd,
                      expected - 1.0);
  }
  text += law.position_power.value < expected
              ? ": a filter that adapts, vibration of the jig or noise behind the solver may cause it."
              : ": the receiver's own noise may grow with range, as from an electric coupling or a gain stage.";
  return text;
}

void addNoiseLaw(const recording::NoiseLaw& law, const SignalBelief& belief,
                 std::vector<recording::GapFinding>& findings) {
  const double expected = recording::kPositionNoisePower + belief.signal.noise_range_power;
  if (differs(law.position_power, expected, kPowerMargin)) {
    findings.push_back({"range_noise", powerText(law, expected), {}});
    return;
  }
  if (belief.coupling_noise && belief.signal.noise_range_power == 0.0 &&
      differs(law.log_coupling_noise, std::log(*belief.coupling_noise), kLevelMargin)) {
    findings.push_back({"range_noise",
                        formatted("The noise of a reading is %.2g times what the scene states: couplings of SD %.2g "
                                  "instead of %.2g per m^3.",
                                  std::exp(law.log_coupling_noise.value) / *belief.coupling_noise,
                                  std::exp(law.log_coupling_noise.value), *belief.coupling_noise),
                        {}});
  }
  if (differs(law.log_transverse_to_radial, std::log(recording::kTransverseToRadial), kAnisotropyMargin)) {
    findings.push_back({"",
                        formatted("Noise across the line of sight is %.1f times that along it; a tracker that solves "
                                  "nine couplings of equal noise by least squares has %.1f, so this one weighs them, "
                                  "filters, or has noise behind its solver.",
                                  std::exp(law.log_transverse_to_radial.value), recording::kTransverseToRadial),
                        {}});
  }
}

void detect(const SampleEvidence& evidence, const SignalBelief& belief, std::vector<recording::GapFinding>& findings) {
  if (evidence.noise_law) addNoiseLaw(*evidence.noise_law, belief, findings);
}

}  // namespace
}  // namespace range_noise

/// More noise than the tracker's data sheet says, or noise that grows with range beyond the law.
///
/// Convention: the SD of every coupling is multiplied by factor (r / 1 m)^power. With power 0 the position noise grows
/// as r^4 and the orientation noise as r^3 from the couplings' own SD alone; a receiver that turns up its amplifier
/// with range, or a long cable, makes the couplings themselves noisier.
/// @source error propagation through nine couplings of equal SD: position r^4, orientation r^3
Effect rangeNoiseEffect() {
  using namespace range_noise;
  Effect effect;
  effect.id = "range_noise";
  effect.label = "Noise beyond the law of range";
  effect.source = "Error propagation through nine couplings of equal SD: position r^4, orientation r^3";
  effect.parameters = {
      declare::number("factor", {0.0, 1e3}, 1.0, "Of the SD of every coupling at 1 m.").plausibly(0.3, 10.0),
      declare::number("power", {-6.0, 6.0}, 0.0, "The SD of every coupling further grows as (range / 1 m)^power.")
          .plausibly(-2.0, 3.0)};
  effect.make = make;
  effect.detect = detect;
  return effect;
}

}  // namespace fieldtrue::effects
