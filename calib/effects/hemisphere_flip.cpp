#include "calib/effects/hemisphere_flip.h"

#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

class HemisphereFlip final : public PhysicalEffect {
 public:
  explicit HemisphereFlip(double probability) : probability_(probability) {}
  void disturb(SignalModel& signal) const override {
    signal.flip_probability = 1.0 - (1.0 - signal.flip_probability) * (1.0 - probability_);
  }

 private:
  double probability_;
};

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  return std::make_unique<HemisphereFlip>(scalarOf(parameters, "probability"));
}

}  // namespace

Effect hemisphereFlipEffect() {
  Effect effect;
  effect.id = "hemisphere_flip";
  effect.label = "Lost hemisphere";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709";
  effect.parameters = {
      {"probability", "", "scalar", 0.02, 0.0, 1.0, "That a visit is reported on the other side.", {}, 0.0, 0.2}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
