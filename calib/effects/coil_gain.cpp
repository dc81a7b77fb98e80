#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace coil_gain {
namespace {

constexpr double kPlausible = 0.1;

void transmitterResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d G = field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
  for (int coil = 0; coil < 3; ++coil) responses[static_cast<std::size_t>(coil)].field_per_m3.col(coil) = G.col(coil);
}

void receiverResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d G = field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
  const Eigen::Matrix3d R = setting.tracker_from_sensor.orientation.toRotationMatrix();
  for (int coil = 0; coil < 3; ++coil) {
    responses[static_cast<std::size_t>(coil)].field_per_m3 = R.col(coil) * (R.col(coil).transpose() * G);
  }
}

void allResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  transmitterResponses(setting, responses.first(3));
  receiverResponses(setting, responses.subspan(3));
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  Eigen::VectorXd gains(6);
  gains << vectorOf(parameters, "transmitter_gain"), vectorOf(parameters, "receiver_gain");
  return linearEffect(allResponses, std::move(gains));
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& /*design*/) {
  const nlohmann::json none = listOf(Eigen::Vector3d::Zero());
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(linearFit({"transmitter", vectorParameters("transmitter_gain", "", kPlausible), transmitterResponses,
                            [none](const Eigen::VectorXd& g) {
                              return nlohmann::json{{"transmitter_gain", listOf(g.head<3>())}, {"receiver_gain", none}};
                            }}));
  ways.push_back(linearFit({"receiver", vectorParameters("receiver_gain", "", kPlausible), receiverResponses,
                            [none](const Eigen::VectorXd& g) {
                              return nlohmann::json{{"transmitter_gain", none}, {"receiver_gain", listOf(g.head<3>())}};
                            }}));
  return ways;
}

}  // namespace
}  // namespace coil_gain

/// Coils, amplifiers or their stored calibration that are stronger or weaker than the tracker believes, each by its own
/// share.
///
/// Convention: the couplings become S' = (1 + diag(g_rx)) S (1 + diag(g_tx)); to first order the field matrix at the
/// sensor changes by
///   dG = G diag(g_tx) + R diag(g_rx) R^T G,   R = tracker_from_sensor,
/// so a transmitter's gain scales a column of S and a receiver's a row.
/// @source coupling matrix: Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; its change to first order by hand
Effect coilGainEffect() {
  using namespace coil_gain;
  Effect effect;
  effect.id = "coil_gain";
  effect.label = "Coil gains";
  effect.source = "Coupling matrix: Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; first order";
  effect.parameters = {
      declare::vector3("transmitter_gain", {-1e3, 1e3}, {0.0, 0.0, 0.0},
                       "Relative gain error of the transmitter's coils x, y, z: 0.01 is 1 % too strong.")
          .plausibly(-kPlausible, kPlausible),
      declare::vector3("receiver_gain", {-1e3, 1e3}, {0.0, 0.0, 0.0}, "Likewise of the receiver's coils.")
          .plausibly(-kPlausible, kPlausible)};
  effect.make = make;
  effect.fits = fits;
  return effect;
}

}  // namespace fieldtrue::effects
