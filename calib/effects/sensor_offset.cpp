#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace sensor_offset {
namespace {

constexpr double kPlausible_m = 0.2;
constexpr double kPlausible_rad = 0.2;

void offsetResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d R = setting.tracker_from_sensor.orientation.toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) responses[static_cast<std::size_t>(axis)].shift_m = R.col(axis);
}

void turnResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d R = setting.tracker_from_sensor.orientation.toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) responses[static_cast<std::size_t>(axis)].turn_rad = R.col(axis);
}

void allResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  offsetResponses(setting, responses.first(3));
  turnResponses(setting, responses.subspan(3));
}

nlohmann::json sceneParameters(const Eigen::Vector3d& offset_m, const Eigen::Vector3d& turn_rad) {
  return {{"offset_m", listOf(offset_m)}, {"turn_rad", listOf(turn_rad)}};
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  Eigen::VectorXd values(6);
  values << vectorOf(parameters, "offset_m"), vectorOf(parameters, "turn_rad");
  return linearEffect(allResponses, std::move(values));
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  if (!design.alignment_known) return ways;
  const std::vector<FitParameter> offset = vectorParameters("offset", "m", kPlausible_m);
  const std::vector<FitParameter> turn = vectorParameters("turn", "rad", kPlausible_rad);
  ways.push_back(linearFit({"lever_arm", offset, offsetResponses, [](const Eigen::VectorXd& v) {
                              return sceneParameters(v.head<3>(), Eigen::Vector3d::Zero());
                            }}));
  if (!design.has_orientation) return ways;
  ways.push_back(linearFit({"mounting", turn, turnResponses, [](const Eigen::VectorXd& v) {
                              return sceneParameters(Eigen::Vector3d::Zero(), v.head<3>());
                            }}));
  std::vector<FitParameter> both = offset;
  both.insert(both.end(), turn.begin(), turn.end());
  ways.push_back(linearFit({"full", both, allResponses,
                            [](const Eigen::VectorXd& v) { return sceneParameters(v.head<3>(), v.tail<3>()); }}));
  return ways;
}

}  // namespace
}  // namespace sensor_offset

/// A sensor whose magnetic centre is not where the rig says, or that is mounted turned.
///
/// Convention: with o and w in the sensor's frame and R = tracker_from_sensor as stated, the centre is really at p + R
/// o and the orientation R exp(w). With one orientation the first is the same as a shift of the transmitter; where the
/// alignment is unknown a constant mounting rotation is a part of it.
/// @source Tsai and Lenz 1989, IEEE Trans. RA-5 345 (sensor to mount transform)
Effect sensorOffsetEffect() {
  using namespace sensor_offset;
  Effect effect;
  effect.id = "sensor_offset";
  effect.label = "Sensor off its mark";
  effect.source = "Tsai and Lenz 1989, IEEE Trans. RA-5 345";
  effect.parameters = {declare::vector3("offset_m", {-100.0, 100.0, "m"}, {0.0, 0.0, 0.0},
                                        "From the point the rig states to the sensor's magnetic centre, sensor frame.")
                           .plausibly(-kPlausible_m, kPlausible_m),
                       declare::vector3("turn_rad", {-100.0, 100.0, "rad"}, {0.0, 0.0, 0.0},
                                        "Rotation vector from the stated mounting to the real one, sensor frame.")
                           .plausibly(-kPlausible_rad, kPlausible_rad)};
  effect.make = make;
  effect.fits = fits;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
