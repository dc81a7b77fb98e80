#include <array>
#include <utility>

#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace coil_nonorthogonality {
namespace {

constexpr double kPlausible_rad = 0.05;
constexpr std::array<std::pair<int, int>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};

void transmitterResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d G = field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
  for (std::size_t i = 0; i < kPairs.size(); ++i) {
    const auto [a, b] = kPairs[i];
    responses[i].field_per_m3.col(a) = G.col(b);
    responses[i].field_per_m3.col(b) = G.col(a);
  }
}

void receiverResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d G = field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
  const Eigen::Matrix3d R = setting.tracker_from_sensor.orientation.toRotationMatrix();
  for (std::size_t i = 0; i < kPairs.size(); ++i) {
    const auto [a, b] = kPairs[i];
    responses[i].field_per_m3 = (R.col(a) * R.col(b).transpose() + R.col(b) * R.col(a).transpose()) * G;
  }
}

void allResponses(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
  transmitterResponses(setting, responses.first(3));
  receiverResponses(setting, responses.subspan(3));
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  Eigen::VectorXd angles_rad(6);
  angles_rad << vectorOf(parameters, "transmitter_rad"), vectorOf(parameters, "receiver_rad");
  return linearEffect(allResponses, std::move(angles_rad));
}

std::vector<FitParameter> anglesOf(const std::string& coils) {
  std::vector<FitParameter> angles;
  for (const char* pair : {"_xy_rad", "_xz_rad", "_yz_rad"}) {
    angles.push_back({coils + pair, "rad", -kPlausible_rad, kPlausible_rad});
  }
  return angles;
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& /*design*/) {
  const nlohmann::json none = listOf(Eigen::Vector3d::Zero());
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(
      linearFit({"transmitter", anglesOf("transmitter"), transmitterResponses, [none](const Eigen::VectorXd& e) {
                   return nlohmann::json{{"transmitter_rad", listOf(e.head<3>())}, {"receiver_rad", none}};
                 }}));
  ways.push_back(linearFit({"receiver", anglesOf("receiver"), receiverResponses, [none](const Eigen::VectorXd& e) {
                              return nlohmann::json{{"transmitter_rad", none}, {"receiver_rad", listOf(e.head<3>())}};
                            }}));
  return ways;
}

}  // namespace
}  // namespace coil_nonorthogonality

/// Coils that do not stand at right angles to each other though the tracker believes so.
///
/// Convention: the couplings become S' = (1 + E_rx) S (1 + E_tx) with E symmetric and zero on the diagonal: E_xy is the
/// angle by which coil x leans toward y and coil y toward x, so the angle between them is 90 deg - 2 E_xy. (The
/// antisymmetric part is a rotation of the whole set of coils.) To first order
///   dG = G E_tx + R E_rx R^T G,   R = tracker_from_sensor.
/// @source coupling matrix: Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; its change to first order by hand
Effect coilNonorthogonalityEffect() {
  using namespace coil_nonorthogonality;
  Effect effect;
  effect.id = "coil_nonorthogonality";
  effect.label = "Coils not at right angles";
  effect.source = "Coupling matrix: Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; first order";
  effect.parameters = {
      declare::vector3("transmitter_rad", {-100.0, 100.0, "rad"}, {0.0, 0.0, 0.0},
                       "How far the transmitter's coils lean toward each other, pairs xy, xz, yz; the angle between "
                       "two coils is 90 deg less twice this.")
          .plausibly(-kPlausible_rad, kPlausible_rad),
      declare::vector3("receiver_rad", {-100.0, 100.0, "rad"}, {0.0, 0.0, 0.0}, "Likewise the receiver's coils.")
          .plausibly(-kPlausible_rad, kPlausible_rad)};
  effect.make = make;
  effect.fits = fits;
  return effect;
}

}  // namespace fieldtrue::effects
