#include "calib/effects/range_noise.h"

#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

class RangeNoise final : public PhysicalEffect {
 public:
  RangeNoise(double factor, double power) : factor_(factor), power_(power) {}
  void disturb(SignalModel& signal) const override {
    signal.noise_factor *= factor_;
    signal.noise_range_power += power_;
  }

 private:
  double factor_;
  double power_;
};

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  return std::make_unique<RangeNoise>(scalarOf(parameters, "factor"), scalarOf(parameters, "power"));
}

}  // namespace

Effect rangeNoiseEffect() {
  Effect effect;
  effect.id = "range_noise";
  effect.label = "Noise beyond the law of range";
  effect.source = "Error propagation through nine couplings of equal SD: position r^4, orientation r^3";
  effect.parameters = {{"factor", "", "scalar", 1.0, 0.0, 1e3, "Of the SD of every coupling at 1 m.", {}, 0.3, 10.0},
                       {"power",
                        "",
                        "scalar",
                        0.0,
                        -6.0,
                        6.0,
                        "The SD of every coupling further grows as (range / 1 m)^power.",
                        {},
                        -2.0,
                        3.0}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
