#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace jig_tilt {
namespace {

constexpr double kPlausible_rad = 0.1;

/// Responses to the shears xz and yz, and xy where there is room for it.
/// @param turns share of the pipe's lean that the sensor follows
void shearResponses(double turns, const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Vector3d q_m = inverse(setting.tracker_from_reference) * setting.tracker_from_sensor.position_m;
  const Eigen::Matrix3d R = setting.tracker_from_reference.orientation.toRotationMatrix();
  responses[0].shift_m = R.col(0) * q_m.z();
  responses[0].turn_rad = turns * R.col(1);
  responses[1].shift_m = R.col(1) * q_m.z();
  responses[1].turn_rad = -turns * R.col(0);
  if (responses.size() > 2) responses[2].shift_m = R.col(0) * q_m.y();
}

UnitResponses shears(double turns) {
  return [turns](const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
    shearResponses(turns, setting, responses);
  };
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return linearEffect(shears(scalarOf(parameters, "turns_sensor")), vectorOf(parameters, "shear_rad"));
}

std::unique_ptr<EffectFit> way(const std::string& name, double turns, bool has_rows) {
  std::vector<FitParameter> linear{{"shear_xz_rad", "rad", -kPlausible_rad, kPlausible_rad},
                                   {"shear_yz_rad", "rad", -kPlausible_rad, kPlausible_rad}};
  if (has_rows) linear.push_back({"shear_xy_rad", "rad", -kPlausible_rad, kPlausible_rad});
  return linearFit(
      {name, std::move(linear), shears(turns), [turns, has_rows](const Eigen::VectorXd& s) {
         return nlohmann::json{{"shear_rad", {s[0], s[1], has_rows ? s[2] : 0.0}}, {"turns_sensor", turns}};
       }});
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(way("upright", 0.0, false));
  if (design.has_orientation) ways.push_back(way("upright_turning", 1.0, false));
  ways.push_back(way("full", 0.0, true));
  return ways;
}

}  // namespace
}  // namespace jig_tilt

/// A rig that leans: its pipes do not stand at right angles to its base, or its rows not to each other.
///
/// Convention: a sensor that the rig says to be at q (rig's frame) is really at q plus the shear
///   (xz q_z + xy q_y, yz q_z, 0),
/// each shear an angle for small angles. With turns_sensor = 1 a sensor fixed to the leaning pipe leans with it, by the
/// rotation vector (-yz, xz, 0) of the rig's frame, which takes the upright z axis to (xz, yz, 1); with 0 it stays
/// level. The shear xy of the rows does not turn it.
/// @source geometry, the rotation to first order by hand
Effect jigTiltEffect() {
  using namespace jig_tilt;
  Effect effect;
  effect.id = "jig_tilt";
  effect.label = "Leaning rig";
  effect.source = "Geometry";
  effect.parameters = {
      declare::vector3("shear_rad", {-100.0, 100.0, "rad"}, {0.0, 0.0, 0.0},
                       "Shears xz, yz, xy of the rig in its own frame: x shifts with height z, y with z, x with y.")
          .plausibly(-kPlausible_rad, kPlausible_rad),
      declare::number("turns_sensor", {0.0, 1.0}, 0.0,
                      "1 where the sensor leans with the pipe it is fixed to, 0 where it stays level.")
          .plausibly(0.0, 1.0)};
  effect.make = make;
  effect.fits = fits;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
