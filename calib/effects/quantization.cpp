#include <algorithm>

#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace quantization {
namespace {

/// Share of a reading's variance above which the lattice is felt.
constexpr double kSmallestShare = 0.1;

class Quantization final : public field::PhysicalEffect {
 public:
  Quantization(double quantum_m, double quantum_rad) : quantum_m_(quantum_m), quantum_rad_(quantum_rad) {}
  void disturb(field::SignalModel& signal) const override {
    signal.quantum_m = std::max(signal.quantum_m, quantum_m_);
    signal.quantum_rad = std::max(signal.quantum_rad, quantum_rad_);
  }

 private:
  double quantum_m_;
  double quantum_rad_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return std::make_unique<Quantization>(scalarOf(parameters, "quantum_m"), scalarOf(parameters, "quantum_rad"));
}

std::string stepText(double quantum_m) { return formatted("%.3g mm", 1000.0 * quantum_m); }

void addLattice(const recording::ReadingLattice& lattice, const SignalBelief& belief, const PlaceNames& names,
                std::vector<recording::GapFinding>& findings) {
  const bool is_felt = lattice.share >= kSmallestShare || 5 * lattice.biased.size() >= lattice.stops;
  if (!is_felt) return;
  const bool is_known = lattice.quantum_m < 1.2 * belief.signal.quantum_m;
  if (is_known && lattice.biased.empty()) return;
  std::string text = "Positions are reported in steps of " + stepText(lattice.quantum_m) +
                     formatted(", %.0f %% of the variance of a reading", 100.0 * lattice.share);
  if (!lattice.biased.empty()) {
    text += "; at " + names.list(lattice.biased) +
            " the noise is below half a step, so averaging does not remove the rounding";
  }
  findings.push_back({is_known ? "" : "quantization", text + ".", is_known ? std::vector<int>() : lattice.biased});
}

void detect(const SampleEvidence& evidence, const SignalBelief& belief, std::vector<recording::GapFinding>& findings) {
  if (evidence.lattice) addLattice(*evidence.lattice, belief, evidence.names, findings);
}

}  // namespace
}  // namespace quantization

/// Readings reported in coarse steps: ASCII with few digits, short binary words.
///
/// Convention: each component of the position is rounded to a multiple of quantum_m, each component of the rotation
/// vector to a multiple of quantum_rad. The coarser of this and the tracker's own step holds. Where the noise is more
/// than half a step the error is uniform, SD step/sqrt(12); below, the mean of a place is biased.
/// @source Widrow and Kollar 2008, Quantization Noise
Effect quantizationEffect() {
  using namespace quantization;
  Effect effect;
  effect.id = "quantization";
  effect.label = "Coarse steps";
  effect.source = "Widrow and Kollar 2008, Quantization Noise";
  effect.parameters = {
      declare::number("quantum_m", {0.0, 1.0, "m"}, 0.00127, "Step of reported positions; 0 = none.")
          .plausibly(0.0, 0.01),
      declare::number("quantum_rad", {0.0, 1.0, "rad"}, 0.0, "Step of reported rotation vectors; 0 = none.")
          .plausibly(0.0, 0.02)};
  effect.make = make;
  effect.detect = detect;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
