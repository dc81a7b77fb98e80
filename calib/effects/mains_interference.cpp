#include "calib/effects/mains_interference.h"

#include <cmath>
#include <numbers>

#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;

class MainsInterference final : public PhysicalEffect {
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

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
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

}  // namespace

Effect mainsInterferenceEffect() {
  Effect effect;
  effect.id = "mains_interference";
  effect.label = "Mains or monitor";
  effect.source = "Aliasing: Oppenheim and Schafer 1989, Discrete-Time Signal Processing, section 3.2";
  effect.parameters = {{"line_hz",
                        "Hz",
                        "list",
                        {50.0, 150.0},
                        0.0,
                        1e6,
                        "Frequencies of the lines, harmonics each for itself.",
                        {},
                        15.0,
                        1000.0},
                       {"amplitude_per_m3",
                        "1/m^3",
                        "list",
                        {4.0e-4, 2.0e-4},
                        0.0,
                        1e6,
                        "Of each line in the couplings, where the transmitter's are (3uu^T - 1)/r^3.",
                        {},
                        0.0,
                        0.01},
                       {"direction",
                        "",
                        "vector3",
                        {1.0, 1.0, 1.0},
                        0.0,
                        0.0,
                        "How strongly each coil of the receiver picks the lines up; any length.",
                        {}},
                       {"phase_rad", "rad", "scalar", 0.0, -100.0, 100.0, "Of every line at time 0.", {}}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
