#include "calib/identify/sample_findings.h"

#include <algorithm>

#include "calib/effects/registry.h"

namespace fieldtrue::identify {
namespace {

effects::SignalBelief beliefOf(const simulation::Scene* scene, const TableMetadata& metadata) {
  effects::SignalBelief belief;
  belief.signal.quantum_m = metadata.quantum_m.value_or(0.0);
  if (scene == nullptr) return belief;
  belief.signal.correlation = scene->tracker.correlation;
  belief.signal.quantum_m = std::max(belief.signal.quantum_m, scene->tracker.quantum_m);
  for (const simulation::EffectInstance& instance : scene->effects) {
    const auto effect = effects::makeEffect(instance.id, instance.parameters);
    if (effect) (*effect)->disturb(belief.signal);
  }
  if (scene->tracker.coupling_noise > 0.0) {
    belief.coupling_noise = scene->tracker.coupling_noise * belief.signal.noise_factor;
  }
  return belief;
}

bool holds(const simulation::Scene* scene, const std::string& effect) {
  return scene != nullptr &&
         std::any_of(scene->effects.begin(), scene->effects.end(),
                     [&](const simulation::EffectInstance& instance) { return instance.id == effect; });
}

/// @param quantum_m believed
effects::SampleEvidence evidenceOf(const SampleTable* samples, const CalibrationTable& table, double quantum_m,
                                   const recording::LineRules& lines) {
  effects::SampleEvidence evidence{.names = PlaceNames(table.nodes)};
  if (samples == nullptr) {
    evidence.noise_law = recording::fitNoiseLaw(recording::noiseRows(table.nodes, quantum_m));
    return evidence;
  }
  TableMetadata metadata = samples->metadata;
  if (!metadata.rate_hz) metadata.rate_hz = table.metadata.rate_hz;
  const std::vector<recording::SampleVisit> visits = recording::sampleVisits(*samples);
  evidence.spectrum = recording::sampleSpectrum(visits, metadata, lines);
  evidence.lattice = recording::readingLattice(*samples, visits);
  const double correlation = evidence.spectrum ? std::max(0.0, evidence.spectrum->correlation) : 0.0;
  evidence.noise_law = recording::fitNoiseLaw(
      recording::noiseRows(visits, correlation, evidence.lattice ? evidence.lattice->quantum_m : quantum_m));
  return evidence;
}

}  // namespace

std::vector<recording::GapFinding> sampleFindings(const SampleTable* samples, const CalibrationTable& table,
                                                  const simulation::Scene* scene, const recording::LineRules& lines) {
  effects::SignalBelief belief = beliefOf(scene, table.metadata);
  const effects::SampleEvidence evidence = evidenceOf(samples, table, belief.signal.quantum_m, lines);
  const bool has_dipoles = table.metadata.transmitter_model.value_or("dipole") == "dipole";
  std::vector<recording::GapFinding> findings;
  for (const effects::Effect& effect : effects::effects()) {
    if (effect.detect == nullptr || (effect.needs_dipoles && !has_dipoles)) continue;
    belief.has_effect = holds(scene, effect.id);
    effect.detect(evidence, belief, findings);
  }
  return findings;
}

}  // namespace fieldtrue::identify
