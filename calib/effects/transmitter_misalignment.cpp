#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace transmitter_misalignment {
namespace {

constexpr double kPlausible_m = 0.2;
constexpr double kPlausible_rad = 0.2;

void responses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Vector3d& p_m = setting.tracker_from_sensor.position_m;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(axis);
    responses[static_cast<std::size_t>(axis)].shift_m = -e;
    responses[static_cast<std::size_t>(axis) + 3].shift_m = -e.cross(p_m);
    responses[static_cast<std::size_t>(axis) + 3].turn_rad = -e;
  }
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  Eigen::VectorXd values(6);
  values << vectorOf(parameters, "shift_m"), vectorOf(parameters, "turn_rad");
  return linearEffect(responses, std::move(values));
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  if (!design.alignment_known) return ways;
  std::vector<FitParameter> linear = vectorParameters("shift", "m", kPlausible_m);
  for (FitParameter& turn : vectorParameters("turn", "rad", kPlausible_rad)) linear.push_back(std::move(turn));
  ways.push_back(
      linearFit({"pose", std::move(linear), responses, [](const Eigen::VectorXd& v) {
                   return nlohmann::json{{"shift_m", listOf(v.head<3>())}, {"turn_rad", listOf(v.tail<3>())}};
                 }}));
  return ways;
}

}  // namespace
}  // namespace transmitter_misalignment

/// A transmitter that does not stand where the rig says.
///
/// Convention: it is shifted by d and turned by the rotation vector w, both in the frame of the transmitter as stated.
/// Seen from the real transmitter a sensor at p then stands, to first order, at p - d - w x p and is turned by -w.
/// @source Horn 1987, J. Opt. Soc. Am. A 4 629 (rigid transform); first order by hand
Effect transmitterMisalignmentEffect() {
  using namespace transmitter_misalignment;
  Effect effect;
  effect.id = "transmitter_misalignment";
  effect.label = "Transmitter out of place";
  effect.source = "Horn 1987, J. Opt. Soc. Am. A 4 629";
  effect.parameters = {
      declare::vector3("shift_m", {-100.0, 100.0, "m"}, {0.0, 0.0, 0.0},
                       "From where the rig says to where it stands, frame of the transmitter as stated.")
          .plausibly(-kPlausible_m, kPlausible_m),
      declare::vector3("turn_rad", {-100.0, 100.0, "rad"}, {0.0, 0.0, 0.0},
                       "Small rotation vector from the stated orientation to the real one, same frame.")
          .plausibly(-kPlausible_rad, kPlausible_rad)};
  effect.make = make;
  effect.fits = fits;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
