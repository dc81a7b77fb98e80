#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace hemisphere_flip {
namespace {

class HemisphereFlip final : public field::PhysicalEffect {
 public:
  explicit HemisphereFlip(double probability) : probability_(probability) {}
  void disturb(field::SignalModel& signal) const override {
    signal.flip_probability = 1.0 - (1.0 - signal.flip_probability) * (1.0 - probability_);
  }

 private:
  double probability_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return std::make_unique<HemisphereFlip>(scalarOf(parameters, "probability"));
}

}  // namespace
}  // namespace hemisphere_flip

/// Visits at which the tracker reports the other of the two positions that its signals allow.
///
/// Convention: the field of dipoles is even, S(p) = S(-p), so a tracker that lost its hemisphere reports -p with the
/// right orientation; each visit does so, all its readings together, with this probability.
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (hemisphere ambiguity)
Effect hemisphereFlipEffect() {
  using namespace hemisphere_flip;
  Effect effect;
  effect.id = "hemisphere_flip";
  effect.label = "Lost hemisphere";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709";
  effect.parameters = {declare::number("probability", {0.0, 1.0}, 0.02, "That a visit is reported on the other side.")
                           .plausibly(0.0, 0.2)};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue::effects
