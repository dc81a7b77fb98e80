#include "calib/effects/correlated_samples.h"

#include <algorithm>

#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

class CorrelatedSamples final : public PhysicalEffect {
 public:
  explicit CorrelatedSamples(double correlation) : correlation_(correlation) {}
  void disturb(SignalModel& signal) const override { signal.correlation = std::max(signal.correlation, correlation_); }

 private:
  double correlation_;
};

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  return std::make_unique<CorrelatedSamples>(scalarOf(parameters, "correlation"));
}

}  // namespace

Effect correlatedSamplesEffect() {
  Effect effect;
  effect.id = "correlated_samples";
  effect.label = "Filtered readings";
  effect.source = "First-order autoregression: Box, Jenkins, Reinsel 1994, Time Series Analysis, section 3.2";
  effect.parameters = {
      {"correlation", "", "scalar", 0.8, 0.0, 0.999, "Between the noise of successive readings.", {}, 0.0, 0.98}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
