#include <algorithm>

#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace correlated_samples {
namespace {

/// Correlation below which 60 readings are worth 45 or more.
constexpr double kSmallestCorrelation = 0.143;
constexpr double kCertainSds = 5.0;

class CorrelatedSamples final : public field::PhysicalEffect {
 public:
  explicit CorrelatedSamples(double correlation) : correlation_(correlation) {}
  void disturb(field::SignalModel& signal) const override {
    signal.correlation = std::max(signal.correlation, correlation_);
  }

 private:
  double correlation_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return std::make_unique<CorrelatedSamples>(scalarOf(parameters, "correlation"));
}

void addCorrelation(const recording::SampleSpectrum& spectrum, const SignalBelief& belief,
                    std::vector<recording::GapFinding>& findings) {
  const double rho = spectrum.correlation;
  if (rho < kSmallestCorrelation || rho < kCertainSds * spectrum.correlation_sd) return;
  if (rho < belief.signal.correlation + std::max(0.1, kCertainSds * spectrum.correlation_sd)) return;
  const auto n = static_cast<double>(spectrum.readings_per_stop);
  findings.push_back({"correlated_samples",
                      formatted("Successive readings follow each other (correlation %.2f +- %.2f): %.0f readings at a "
                                "place are worth %.0f independent ones.",
                                rho, spectrum.correlation_sd, n, std::max(1.0, n * (1.0 - rho) / (1.0 + rho))),
                      {}});
}

void detect(const SampleEvidence& evidence, const SignalBelief& belief, std::vector<recording::GapFinding>& findings) {
  if (evidence.spectrum) addCorrelation(*evidence.spectrum, belief, findings);
}

}  // namespace
}  // namespace correlated_samples

/// Successive readings that are not independent, because the tracker filters them.
///
/// Convention: the noise of the couplings is first-order autoregressive, n' = rho n + sqrt(1 - rho^2) w. The mean of N
/// readings is then worth N (1 - rho)/(1 + rho) independent ones. The filter's own correlation and this one do not add:
/// the larger holds.
/// @source Box, Jenkins, Reinsel 1994, Time Series Analysis, section 3.2
Effect correlatedSamplesEffect() {
  using namespace correlated_samples;
  Effect effect;
  effect.id = "correlated_samples";
  effect.label = "Filtered readings";
  effect.source = "First-order autoregression: Box, Jenkins, Reinsel 1994, Time Series Analysis, section 3.2";
  effect.parameters = {declare::number("correlation", {0.0, 0.999}, 0.8, "Between the noise of successive readings.")
                           .plausibly(0.0, 0.98)};
  effect.make = make;
  effect.detect = detect;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
