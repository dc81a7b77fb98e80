#include "calib/effects/compact_metal.h"

#include <numbers>

#include "calib/core/units.h"
#include "calib/effects/metal_body.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace compact_metal {
namespace {

class CompactMetal final : public field::CouplingDistortion {
 public:
  explicit CompactMetal(const MetalBody& body)
      : center_m_(body.center_m),
        radius_m_(body.radius_m),
        moment_m3_(body.polarizability_m3 * field::dipoleField(body.center_m, 1.0 / (4.0 * kPi))) {}

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double /*time_s*/) const override {
    return field::dipoleField(p_sensor_m - center_m_, dipole_constant_m3) * moment_m3_;
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override { return (p_sensor_m - center_m_).norm() > radius_m_; }

 private:
  Eigen::Vector3d center_m_;
  double radius_m_;
  Eigen::Matrix3d moment_m3_;  ///< A G(b) / (4 pi) for C = 1.
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& excitation) {
  FT_TRY(const MetalBody body, bodyOf(parameters, excitation, "compact_metal"));
  return std::make_unique<CompactMetal>(body);
}

class CompactMetalFit final : public EffectFit {
 public:
  CompactMetalFit(const FitDesign& design, BodyShape shape) : search_(design), shape_(shape) {}

  std::string name() const override { return shape_ == BodyShape::kSphere ? "sphere" : "tensor"; }
  bool searchesPlace() const override { return true; }
  std::vector<FitParameter> searched() const override { return search_.centerParameters(); }
  std::vector<FitParameter> linear() const override { return polarizabilityParameters(shape_); }

  std::vector<Eigen::VectorXd> starts() const override {
    std::vector<Eigen::VectorXd> starts;
    for (const Eigen::Vector3d& p_m : search_.around_m(0.38, {0.25, 0.5, 0.9})) starts.emplace_back(p_m);
    for (const Eigen::Vector3d& p_m : search_.aboutTransmitter_m()) starts.emplace_back(p_m);
    return starts;
  }

  bool allows(const Eigen::VectorXd& searched) const override { return search_.allowsCenter(searched.head<3>()); }

  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    const Eigen::Vector3d center_m = searched.head<3>();
    const Eigen::Matrix3d field_of_transmitter = field::dipoleField(center_m, 1.0 / (4.0 * kPi));
    const std::size_t count = shape_ == BodyShape::kSphere ? 1 : 6;
    for (std::size_t i = 0; i < at.size(); ++i) {
      respondAsBody(shape_, center_m, field_of_transmitter, at[i].tracker_from_sensor.position_m,
                    responses.subspan(i * count, count));
    }
  }

  FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const override {
    return describeBody(shape_, searched.head<3>(), linear, search_);
  }

 private:
  RoomSearch search_;
  BodyShape shape_;
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(std::make_unique<CompactMetalFit>(design, BodyShape::kSphere));
  ways.push_back(std::make_unique<CompactMetalFit>(design, BodyShape::kTensor));
  return ways;
}

}  // namespace
}  // namespace compact_metal

double spherePolarizability_m3(double radius_m, bool is_ferromagnetic, double relative_permeability) {
  const double a3 = radius_m * radius_m * radius_m;
  if (!is_ferromagnetic) return -2.0 * std::numbers::pi * a3;
  return (4.0 * kPi) * a3 * (relative_permeability - 1.0) / (relative_permeability + 2.0);
}

std::unique_ptr<field::CouplingDistortion> makeCompactMetal(const Eigen::Vector3d& center_m,
                                                            const Eigen::Matrix3d& polarizability_m3, double radius_m) {
  using namespace compact_metal;
  return std::make_unique<CompactMetal>(MetalBody{center_m, polarizability_m3, radius_m});
}

/// A metal body small against its distances to transmitter and sensor: the field there induces one dipole.
///
/// Convention: in a field H the body has the magnetic moment m = A H, A in m^3. A dipole m makes the field
/// (3uu^T - I) m / (4 pi r^3), so with G of constant 1/(4 pi) from the body at b to the sensor at p
///   dG = G(p - b; 1/(4 pi)) A G(b; C).
/// A is then -2 pi a^3 for a perfectly conducting sphere of radius a and 4 pi a^3 (mu_r - 1)/(mu_r + 2) for a permeable
/// one (A = V chi with chi = -3/2 and 3 (mu_r - 1)/(mu_r + 2)). Bodies do not see each other's fields.
/// @source Raab, Blood, Steiner, Jones 1979, section on field distortion; sphere: Wait 1951, Geophysics 16 666, limits
/// of high and zero frequency
Effect compactMetalEffect() {
  using namespace compact_metal;
  Effect effect;
  effect.id = "compact_metal";
  effect.label = "Compact metal body";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; sphere: Wait 1951, Geophysics 16 666";
  effect.parameters = bodyParameters();
  effect.make = make;
  effect.fits = fits;
  effect.body = ballOf;
  return effect;
}

}  // namespace fieldtrue::effects
