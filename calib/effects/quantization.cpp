#include "calib/effects/quantization.h"

#include <algorithm>

#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

class Quantization final : public PhysicalEffect {
 public:
  Quantization(double quantum_m, double quantum_rad) : quantum_m_(quantum_m), quantum_rad_(quantum_rad) {}
  void disturb(SignalModel& signal) const override {
    signal.quantum_m = std::max(signal.quantum_m, quantum_m_);
    signal.quantum_rad = std::max(signal.quantum_rad, quantum_rad_);
  }

 private:
  double quantum_m_;
  double quantum_rad_;
};

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  return std::make_unique<Quantization>(scalarOf(parameters, "quantum_m"), scalarOf(parameters, "quantum_rad"));
}

}  // namespace

Effect quantizationEffect() {
  Effect effect;
  effect.id = "quantization";
  effect.label = "Coarse steps";
  effect.source = "Widrow and Kollar 2008, Quantization Noise";
  effect.parameters = {
      {"quantum_m", "m", "scalar", 0.00127, 0.0, 1.0, "Step of reported positions; 0 = none.", {}, 0.0, 0.01},
      {"quantum_rad", "rad", "scalar", 0.0, 0.0, 1.0, "Step of reported rotation vectors; 0 = none.", {}, 0.0, 0.02}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
