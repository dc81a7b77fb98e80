#include <cmath>
#include <numbers>

#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"
#include "calib/recording/line_sources.h"

namespace fieldtrue::effects {

namespace mains_interference {
namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;

class MainsInterference final : public field::PhysicalEffect {
 public:
  MainsInterference(std::vector<double> line_hz, std::vector<double> amplitude_per_m3, const Eigen::Vector3d& direction,
                    double phase_rad)
      : line_hz_(std::move(line_hz)),
        amplitude_per_m3_(std::move(amplitude_per_m3)),
        direction_(direction),
        phase_rad_(phase_rad) {}

  Eigen::Matrix3d interference_per_m3(double time_s) const override {
    Eigen::RowVector3d waves = Eigen::RowVector3d::Zero();
    for (std::size_t line = 0; line < line_hz_.size(); ++line) {
      // The fraction of a cycle first: 2 pi f t itself loses digits late in a session.
      const double cycles = line_hz_[line] * time_s;
      const double angle_rad = kTurn_rad * (cycles - std::floor(cycles)) + phase_rad_;
      for (int coil = 0; coil < 3; ++coil) {
        waves[coil] += amplitude_per_m3_[line] * std::cos(angle_rad + kTurn_rad * coil / 3.0);
      }
    }
    return direction_ * waves;
  }

 private:
  std::vector<double> line_hz_;
  std::vector<double> amplitude_per_m3_;
  Eigen::Vector3d direction_;
  double phase_rad_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  std::vector<double> line_hz = numbersOf(parameters, "line_hz");
  std::vector<double> amplitude_per_m3 = numbersOf(parameters, "amplitude_per_m3");
  const Eigen::Vector3d direction = vectorOf(parameters, "direction");
  if (line_hz.size() != amplitude_per_m3.size()) {
    return fail(ErrorCode::kBadInput, "mains_interference: line_hz has " + std::to_string(line_hz.size()) +
                                          " numbers and amplitude_per_m3 " + std::to_string(amplitude_per_m3.size()) +
                                          "; every line needs one of each.");
  }
  if (direction.norm() < 1e-6) {
    return fail(ErrorCode::kBadInput, "mains_interference: direction is " + textOf(direction) +
                                          "; it must say how strongly each coil of the receiver picks the line up.");
  }
  return std::make_unique<MainsInterference>(std::move(line_hz), std::move(amplitude_per_m3), direction.normalized(),
                                             scalarOf(parameters, "phase_rad"));
}

std::string sourcesText(const std::vector<recording::LineSource>& sources) {
  std::string text;
  const std::size_t named = std::min<std::size_t>(sources.size(), 3);
  for (std::size_t i = 0; i < named; ++i) text += (i == 0 ? "" : i + 1 == named ? " or " : ", ") + sources[i].name;
  return text;
}

void addLines(const recording::SampleSpectrum& spectrum, const SignalBelief& belief,
              std::vector<recording::GapFinding>& findings) {
  const double resolution_hz = spectrum.rate_hz / static_cast<double>(spectrum.readings_per_stop);
  for (const recording::SpectralLine& line : spectrum.lines) {
    const double tolerance_hz = std::max(0.15 * resolution_hz, 3.0 * line.error_hz) + 0.002 * spectrum.rate_hz;
    const auto sources = recording::lineSources(line.frequency_hz, spectrum.rate_hz, tolerance_hz);
    std::string text =
        formatted("A line at %.1f Hz of %.2g times a reading's noise", line.frequency_hz, line.amplitude_sd);
    text += sources.empty() ? ": no alias of the mains or of a monitor, so a motor, a fan or another transmitter; "
                            : ": " + sourcesText(sources) + ", ";
    text += formatted("seen at %.4g readings a second.", spectrum.rate_hz);
    const bool is_new = !sources.empty() && !belief.has_effect;
    findings.push_back({is_new ? "mains_interference" : "", text, {}});
  }
}

void detect(const SampleEvidence& evidence, const SignalBelief& belief, std::vector<recording::GapFinding>& findings) {
  if (evidence.spectrum) addLines(*evidence.spectrum, belief, findings);
}

}  // namespace
}  // namespace mains_interference

/// Mains wiring or a monitor whose magnetic field the receiver picks up beside the transmitter's.
///
/// Convention: a line of frequency f adds to the couplings, at the time t of a reading,
///   dS_ik = amplitude d_i cos(2 pi f t + phase + 2 pi k/3),
/// d the direction in the sensor's axes, of length 1, and k the transmitter's coil: the three are told apart one after
/// the other within a cycle, so each meets the line at another phase. Aliasing follows from when readings are taken: at
/// the rate fs a line shows at |f - n fs|. Where that is 0 it is a constant during a visit. Mains and tracker run on
/// clocks of their own, so between two visits the phase is lost.
/// @source Oppenheim and Schafer 1989, Discrete-Time Signal Processing, section 3.2 (aliasing)
Effect mainsInterferenceEffect() {
  using namespace mains_interference;
  Effect effect;
  effect.id = "mains_interference";
  effect.label = "Mains or monitor";
  effect.source = "Aliasing: Oppenheim and Schafer 1989, Discrete-Time Signal Processing, section 3.2";
  effect.parameters = {declare::numbers("line_hz", {0.0, 1e6, "Hz"}, {50.0, 150.0},
                                        "Frequencies of the lines, harmonics each for itself.")
                           .plausibly(15.0, 1000.0),
                       declare::numbers("amplitude_per_m3", {0.0, 1e6, "1/m^3"}, {4.0e-4, 2.0e-4},
                                        "Of each line in the couplings, where the transmitter's are (3uu^T - 1)/r^3.")
                           .plausibly(0.0, 0.01),
                       declare::vector3("direction", {}, {1.0, 1.0, 1.0},
                                        "How strongly each coil of the receiver picks the lines up; any length."),
                       declare::number("phase_rad", {-100.0, 100.0, "rad"}, 0.0, "Of every line at time 0.")};
  effect.make = make;
  effect.detect = detect;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
