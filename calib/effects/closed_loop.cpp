#include "calib/effects/closed_loop.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/file_io.h"
#include "calib/effects/parameters.h"
#include "calib/effects/room_search.h"
#include "calib/effects/rows.h"
#include "calib/field/metal_response.h"

namespace fieldtrue::effects {

namespace closed_loop {
namespace {

struct EllipticIntegrals {
  double K = 0.0;
  double E = 0.0;
};

/// Complete elliptic integrals by the arithmetic-geometric mean, several times as fast as the standard library's.
/// @param modulus_squared k^2
/// @param complement sqrt(1 - k^2), not zero
/// @source Abramowitz and Stegun 1964, section 17.6
EllipticIntegrals ellipticIntegrals(double modulus_squared, double complement) {
  double a = 1.0;
  double b = complement;
  double weight = 0.5;
  double sum = weight * modulus_squared;
  for (double c = 1.0; std::abs(c) > 1e-9;) {
    c = 0.5 * (a - b);
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
    weight *= 2.0;
    sum += weight * c * c;
  }
  const double K = 0.5 * std::numbers::pi / a;
  return {K, K * (1.0 - sum)};
}

/// Distance from a place to the wire of a ring about the origin.
double fromWire_m(const Eigen::Vector3d& from_center_m, const Eigen::Vector3d& axis, double radius_m) {
  const double z_m = axis.dot(from_center_m);
  const double rho_m = (from_center_m - z_m * axis).norm();
  return std::sqrt((rho_m - radius_m) * (rho_m - radius_m) + z_m * z_m);
}

class ClosedLoop final : public field::CouplingDistortion {
 public:
  ClosedLoop(const Eigen::Vector3d& center_m, const Eigen::Vector3d& axis, double radius_m, double wire_radius_m,
             double strength)
      : center_m_(center_m), axis_(axis), radius_m_(radius_m), wire_radius_m_(wire_radius_m) {
    const double inductance_m = radius_m * (std::log(8.0 * radius_m / wire_radius_m) - 2.0);
    current_m_ = -strength * 4.0 * std::numbers::pi / inductance_m * ringField_per_m(-center_m, axis, radius_m);
  }

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double /*time_s*/) const override {
    return dipole_constant_m3 * ringField_per_m(p_sensor_m - center_m_, axis_, radius_m_) * current_m_.transpose();
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override {
    return fromWire_m(p_sensor_m - center_m_, axis_, radius_m_) > wire_radius_m_;
  }

 private:
  Eigen::Vector3d center_m_;
  Eigen::Vector3d axis_;
  double radius_m_;
  double wire_radius_m_;
  Eigen::Vector3d current_m_;  ///< Induced by each transmitter coil, for C = 1 [1/m^2].
};

/// R/L of a ring of round wire: R = 2 pi radius/(sigma pi a^2), L = mu_0 radius (ln(8 radius/a) - 2).
double decayRate_per_s(double radius_m, double wire_radius_m, double conductivity_s_per_m) {
  const double resistance_ohm = 2.0 * radius_m / (conductivity_s_per_m * wire_radius_m * wire_radius_m);
  return resistance_ohm / (field::kMu0_h_per_m * radius_m * (std::log(8.0 * radius_m / wire_radius_m) - 2.0));
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& excitation) {
  const Eigen::Vector3d center_m = vectorOf(parameters, "center_m");
  const Eigen::Vector3d normal = vectorOf(parameters, "normal");
  const double radius_m = scalarOf(parameters, "radius_m");
  const double wire_radius_m = scalarOf(parameters, "wire_radius_m");
  if (normal.norm() < 1e-6) {
    return fail(ErrorCode::kBadInput,
                "closed_loop: normal is " + textOf(normal) + "; it must point along the axis of the loop.");
  }
  if (wire_radius_m > 0.25 * radius_m) {
    return fail(ErrorCode::kBadInput, "closed_loop: wire_radius_m is " + formatNumber(wire_radius_m) +
                                          "; it must be at most a quarter of radius_m, which is " +
                                          formatNumber(radius_m) + ".");
  }
  const Eigen::Vector3d axis = normal.normalized();
  if (fromWire_m(-center_m, axis, radius_m) <= wire_radius_m) {
    return fail(ErrorCode::kBadInput, "closed_loop: center_m " + textOf(center_m) +
                                          " puts the transmitter inside the wire of the loop; move the loop.");
  }
  double strength = scalarOf(parameters, "strength");
  const nlohmann::json& conductivity = parameters.at("conductivity_s_per_m");
  if (!conductivity.is_null()) {
    strength *= field::inductiveShare(decayRate_per_s(radius_m, wire_radius_m, conductivity.get<double>()), excitation);
  }
  return std::make_unique<ClosedLoop>(center_m, axis, radius_m, wire_radius_m, strength);
}

constexpr double kWireRadius_m = 0.005;
constexpr double kSmallestRing_m = 0.05;
constexpr double kLargestRing_m = 1.5;
constexpr double kNearestToWire_m = 0.06;

class ClosedLoopFit final : public EffectFit {
 public:
  explicit ClosedLoopFit(const FitDesign& design) : search_(design) {}

  std::string name() const override { return "loop"; }

  bool searchesPlace() const override { return true; }
  std::vector<FitParameter> searched() const override {
    std::vector<FitParameter> parameters = search_.centerParameters();
    for (FitParameter& angle : DirectionChart::parameters()) parameters.push_back(std::move(angle));
    parameters.push_back({"radius_m", "m", kSmallestRing_m, kLargestRing_m});
    return parameters;
  }

  std::vector<FitParameter> linear() const override { return {{"strength", "", 0.0, 2.0}}; }

  std::vector<Eigen::VectorXd> starts() const override {
    std::vector<Eigen::VectorXd> starts;
    for (const Eigen::Vector3d& p_m : search_.around_m(0.95, {0.3, 0.75})) {
      for (const Eigen::Vector3d& normal : firstNormals()) {
        Eigen::VectorXd start(6);
        start << p_m, chart_.angles_rad(normal), 0.25;
        if (allows(start)) starts.push_back(start);
      }
    }
    return starts;
  }

  bool allows(const Eigen::VectorXd& searched) const override {
    const Eigen::Vector3d center_m = searched.head<3>();
    const double radius_m = searched[5];
    if (!(radius_m >= kSmallestRing_m && radius_m <= kLargestRing_m) || !search_.allowsCenter(center_m)) return false;
    const Eigen::Vector3d axis = chart_.direction(searched[3], searched[4]);
    const auto isOffWire = [&](const Eigen::Vector3d& p_m) {
      return fromWire_m(p_m - center_m, axis, radius_m) >= kNearestToWire_m;
    };
    return isOffWire(Eigen::Vector3d::Zero()) &&
           std::all_of(search_.places_m().begin(), search_.places_m().end(), isOffWire);
  }

  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    const ClosedLoop loop(searched.head<3>(), chart_.direction(searched[3], searched[4]), searched[5], kWireRadius_m,
                          1.0);
    for (std::size_t i = 0; i < at.size(); ++i) responses[i] = loop.at(at[i]);
  }

  FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const override {
    const Eigen::Vector3d center_m = searched.head<3>();
    const Eigen::Vector3d normal = chart_.direction(searched[3], searched[4]);
    FittedEffect fitted;
    fitted.parameters = {{"center_m", {center_m.x(), center_m.y(), center_m.z()}},
                         {"normal", {normal.x(), normal.y(), normal.z()}},
                         {"radius_m", searched[5]},
                         {"wire_radius_m", kWireRadius_m},
                         {"strength", linear[0]}};
    fitted.values = {{"center_x_m", "m", center_m.x()}, {"center_y_m", "m", center_m.y()},
                     {"center_z_m", "m", center_m.z()}, {"normal_x", "", normal.x()},
                     {"normal_y", "", normal.y()},      {"normal_z", "", normal.z()},
                     {"radius_m", "m", searched[5]},    {"strength", "", linear[0]}};
    fitted.location_m = center_m;
    // A thicker wire carries up to twice the current that one of 5 mm radius would.
    fitted.is_plausible = linear[0] >= 0.0 && linear[0] <= 2.0;
    if (!fitted.is_plausible) {
      fitted.doubt = linear[0] < 0.0 ? "a current that aids the transmitter's field, which no closed loop carries"
                                     : "a current " + formatNumber(std::round(10.0 * linear[0]) / 10.0) +
                                           " times that of a loop without resistance";
    }
    return fitted;
  }

 private:
  RoomSearch search_;
  DirectionChart chart_;
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(std::make_unique<ClosedLoopFit>(design));
  return ways;
}

}  // namespace
}  // namespace closed_loop

Eigen::Vector3d ringField_per_m(const Eigen::Vector3d& from_center_m, const Eigen::Vector3d& axis, double radius_m) {
  using namespace closed_loop;
  const double z_m = axis.dot(from_center_m);
  const Eigen::Vector3d across_m = from_center_m - z_m * axis;
  const double rho_m = across_m.norm();
  const double on_axis_m2 = radius_m * radius_m + z_m * z_m;
  // Close to the axis the two elliptic integrals cancel; the series' next term is below 1e-8 of it there.
  if (rho_m * rho_m < 1e-8 * on_axis_m2) {
    const double along = radius_m * radius_m / (2.0 * on_axis_m2 * std::sqrt(on_axis_m2));
    return along * axis + 1.5 * z_m / on_axis_m2 * along * across_m;
  }
  const double far_m2 = (radius_m + rho_m) * (radius_m + rho_m) + z_m * z_m;
  const double near_m2 = (radius_m - rho_m) * (radius_m - rho_m) + z_m * z_m;
  const auto [K, E] = ellipticIntegrals(4.0 * radius_m * rho_m / far_m2, std::sqrt(near_m2 / far_m2));
  const double scale_per_m = 1.0 / (2.0 * std::numbers::pi * std::sqrt(far_m2));
  const double along = scale_per_m * (K + (radius_m * radius_m - rho_m * rho_m - z_m * z_m) / near_m2 * E);
  const double outward =
      scale_per_m * z_m / rho_m * ((radius_m * radius_m + rho_m * rho_m + z_m * z_m) / near_m2 * E - K);
  return along * axis + outward / rho_m * across_m;
}

/// A closed conducting ring (a cable with both ends joined, a window frame, a coil of copper) in which the transmitter
/// induces a current.
///
/// Convention: in a field H the transmitter's coil k has the moment 4 pi C e_k. With h(p) the field at p of unit
/// current in the ring, the flux of a moment m at t through it is mu_0 h(t) . m (reciprocity), and where inductance
/// limits the current, as it does in copper at an AC tracker's carrier, the ring keeps the flux out: L I = -flux, so
///   dG = -strength 4 pi C h(p) h(t)^T / (R (ln(8 R/a) - 2)),
/// R and a the radii of ring and wire. Below the carrier at which the ring's resistance equals its reactance only a
/// part of that current flows, which `strength` says; what is left is in quadrature and not seen by the tracker. With
/// the wire's conductivity given, that part is (w L)^2/(R^2 + (w L)^2) at a carrier and exp(-t R/L) at a sampling
/// delay, R at direct current.
/// @source Jackson 1999, Classical Electrodynamics, section 5.5 (field of a current ring); L: Maxwell 1873, art. 704
Effect closedLoopEffect() {
  using namespace closed_loop;
  Effect effect;
  effect.id = "closed_loop";
  effect.label = "Closed conducting loop";
  effect.source = "Jackson 1999, Classical Electrodynamics, section 5.5; inductance: Maxwell 1873, art. 704";
  effect.parameters = {
      centerParameter("Middle of the loop, tracker frame."),
      declare::vector3("normal", {}, {0.0, 0.0, 1.0}, "Axis of the loop, tracker frame; any length."),
      declare::number("radius_m", {0.01, 10.0, "m"}, 0.3, "Of the loop.").plausibly(0.05, 2.0),
      declare::number("wire_radius_m", {1e-4, 0.5, "m"}, 0.005, "Of the wire or tube it is made of.")
          .plausibly(5e-4, 0.02),
      declare::number(
          "conductivity_s_per_m", {1.0, 1e8, "S/m"}, nullptr,
          "Of the wire: copper 5.8e7, aluminium 3.5e7, steel 6e6. When given, its resistance and the tracker's carrier "
          "or sampling delay decide how much of the current is left; null is a loop without resistance.")
          .plausibly(5e6, 6e7),
      declare::number("strength", {-100.0, 100.0}, 1.0,
                      "Share of the current a loop without resistance would carry; below 1 for thin wire, bad joints "
                      "or a low carrier. No real loop has more than 1 or less than 0.")
          .plausibly(0.0, 1.0)};
  effect.make = make;
  effect.fits = fits;
  effect.body = loopOf;
  return effect;
}

}  // namespace fieldtrue::effects
