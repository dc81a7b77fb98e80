#include "calib/gap/sample_findings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/effects/registry.h"
#include "calib/gap/cleaning.h"
#include "calib/gap/noise_law.h"
#include "calib/gap/reading_lattice.h"
#include "calib/gap/sample_spectrum.h"

namespace fieldtrue {

namespace {

constexpr double kSds = 3.0;
/// Correlation below which 60 readings are worth 45 or more.
constexpr double kSmallestCorrelation = 0.143;
constexpr double kCertainSds = 5.0;
/// Share of a reading's variance above which the lattice is felt.
constexpr double kSmallestShare = 0.1;
/// Powers and levels nearer the expected ones than this are a solver's own way.
constexpr double kPowerMargin = 0.35;
constexpr double kLevelMargin = 0.3;
constexpr double kAnisotropyMargin = 0.5;

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// What the scene already says of the electronics.
struct Belief {
  SignalModel signal;
  std::optional<double> coupling_noise;  ///< Over the dipole constant [1/m^3].
  bool has_interference = false;
};

Belief beliefOf(const Scene* scene, const TableMetadata& metadata) {
  Belief belief;
  belief.signal.quantum_m = metadata.quantum_m.value_or(0.0);
  if (scene == nullptr) return belief;
  belief.signal.correlation = scene->tracker.correlation;
  belief.signal.quantum_m = std::max(belief.signal.quantum_m, scene->tracker.quantum_m);
  for (const EffectInstance& instance : scene->effects) {
    const auto effect = makeEffect(instance.id, instance.parameters);
    if (!effect) continue;
    (*effect)->disturb(belief.signal);
    belief.has_interference = belief.has_interference || instance.id == "mains_interference";
  }
  if (scene->tracker.coupling_noise > 0.0) {
    belief.coupling_noise = scene->tracker.coupling_noise * belief.signal.noise_factor;
  }
  return belief;
}

std::string sourcesText(const std::vector<LineSource>& sources) {
  std::string text;
  const std::size_t named = std::min<std::size_t>(sources.size(), 3);
  for (std::size_t i = 0; i < named; ++i) text += (i == 0 ? "" : i + 1 == named ? " or " : ", ") + sources[i].name;
  return text;
}

void addLines(const SampleSpectrum& spectrum, const Belief& belief, std::vector<GapFinding>& findings) {
  const double resolution_hz = spectrum.rate_hz / static_cast<double>(spectrum.readings_per_stop);
  for (const SpectralLine& line : spectrum.lines) {
    const double tolerance_hz = std::max(0.15 * resolution_hz, 3.0 * line.error_hz) + 0.002 * spectrum.rate_hz;
    const auto sources = lineSources(line.frequency_hz, spectrum.rate_hz, tolerance_hz);
    std::string text =
        formatted("A line at %.1f Hz of %.2g times a reading's noise", line.frequency_hz, line.amplitude_sd);
    text += sources.empty() ? ": no alias of the mains or of a monitor, so a motor, a fan or another transmitter; "
                            : ": " + sourcesText(sources) + ", ";
    text += formatted("seen at %.4g readings a second.", spectrum.rate_hz);
    const bool is_new = !sources.empty() && !belief.has_interference;
    findings.push_back({is_new ? "mains_interference" : "", text, {}});
  }
}

void addCorrelation(const SampleSpectrum& spectrum, const Belief& belief, std::vector<GapFinding>& findings) {
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

std::string stepText(double quantum_m) { return formatted("%.3g mm", 1000.0 * quantum_m); }

void addLattice(const ReadingLattice& lattice, const Belief& belief, std::vector<GapFinding>& findings) {
  const bool is_felt = lattice.share >= kSmallestShare || 5 * lattice.biased.size() >= lattice.stops;
  if (!is_felt) return;
  const bool is_known = lattice.quantum_m < 1.2 * belief.signal.quantum_m;
  if (is_known && lattice.biased.empty()) return;
  std::string text = "Positions are reported in steps of " + stepText(lattice.quantum_m) +
                     formatted(", %.0f %% of the variance of a reading", 100.0 * lattice.share);
  if (!lattice.biased.empty()) {
    text += "; at " + nodesText(lattice.biased) +
            " the noise is below half a step, so averaging does not remove the rounding";
  }
  findings.push_back({is_known ? "" : "quantization", text + ".", is_known ? std::vector<int>() : lattice.biased});
}

bool differs(const Uncertain& seen, double expected, double margin) {
  return std::abs(seen.value - expected) > margin + kSds * seen.sd;
}

std::string powerText(const NoiseLaw& law, double expected) {
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

void addNoiseLaw(const NoiseLaw& law, const Belief& belief, std::vector<GapFinding>& findings) {
  const double expected = kPositionNoisePower + belief.signal.noise_range_power;
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
  if (differs(law.log_transverse_to_radial, std::log(kTransverseToRadial), kAnisotropyMargin)) {
    findings.push_back({"",
                        formatted("Noise across the line of sight is %.1f times that along it; a tracker that solves "
                                  "nine couplings of equal noise by least squares has %.1f, so this one weighs them, "
                                  "filters, or has noise behind its solver.",
                                  std::exp(law.log_transverse_to_radial.value), kTransverseToRadial),
                        {}});
  }
}

}  // namespace

std::vector<GapFinding> sampleFindings(const SampleTable* samples, const CalibrationTable& table, const Scene* scene) {
  std::vector<GapFinding> findings;
  const Belief belief = beliefOf(scene, table.metadata);
  std::vector<NoiseRow> rows;
  if (samples != nullptr) {
    TableMetadata metadata = samples->metadata;
    if (!metadata.rate_hz) metadata.rate_hz = table.metadata.rate_hz;
    const std::vector<SampleVisit> visits = sampleVisits(*samples);
    const auto spectrum = sampleSpectrum(visits, metadata);
    const auto lattice = readingLattice(*samples, visits);
    if (spectrum) {
      addLines(*spectrum, belief, findings);
      addCorrelation(*spectrum, belief, findings);
    }
    if (lattice) addLattice(*lattice, belief, findings);
    rows = noiseRows(visits, spectrum ? std::max(0.0, spectrum->correlation) : 0.0,
                     lattice ? lattice->quantum_m : belief.signal.quantum_m);
  } else {
    rows = noiseRows(table.nodes, belief.signal.quantum_m);
  }
  if (const auto law = fitNoiseLaw(rows)) addNoiseLaw(*law, belief, findings);
  return findings;
}

}  // namespace fieldtrue
