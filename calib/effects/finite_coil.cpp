#include <cmath>

#include "calib/core/file_io.h"
#include "calib/effects/closed_loop.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace finite_coil {
namespace {

enum class Coil { kTransmitter, kReceiver };

const char* nameOf(Coil coil) { return coil == Coil::kTransmitter ? "transmitter" : "receiver"; }

/// Fourth derivative of 1/r at p along a, a, a and b [1/m^5]; a of unit length.
double fourthDerivative_per_m5(const Eigen::Vector3d& p_m, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double r_m = p_m.norm();
  const double ua = a.dot(p_m) / r_m;
  const double ub = b.dot(p_m) / r_m;
  const double ab = a.dot(b);
  return (105.0 * ua * ua * ua * ub - 45.0 * (ab * ua * ua + ua * ub) + 9.0 * ab) / std::pow(r_m, 5);
}

/// Change of the couplings per a^2, rows along the sensor's axes: -(1/8) of the fourth derivatives.
Eigen::Matrix3d leadingTerm_per_m5(Coil coil, const Pose& tracker_from_sensor) {
  const Eigen::Matrix3d R = tracker_from_sensor.orientation.toRotationMatrix();
  Eigen::Matrix3d change;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d of_sensor = R.col(i);
      const Eigen::Vector3d of_transmitter = Eigen::Vector3d::Unit(k);
      const bool is_transmitter = coil == Coil::kTransmitter;
      change(i, k) =
          -0.125 * fourthDerivative_per_m5(tracker_from_sensor.position_m, is_transmitter ? of_transmitter : of_sensor,
                                           is_transmitter ? of_sensor : of_transmitter);
    }
  }
  return change;
}

/// Field change in the tracker frame of a leading term along the sensor's axes.
field::EffectResponse leadingResponse(Coil coil, const Pose& tracker_from_sensor, double radius_squared_m2) {
  field::EffectResponse response;
  response.field_per_m3 = radius_squared_m2 * (tracker_from_sensor.orientation.toRotationMatrix() *
                                               leadingTerm_per_m5(coil, tracker_from_sensor));
  return response;
}

/// To leading order, as it is fitted.
class SmallCoils final : public field::PhysicalEffect {
 public:
  SmallCoils(Coil coil, double radius_squared_m2) : coil_(coil), radius_squared_m2_(radius_squared_m2) {}
  field::EffectResponse at(const field::SensorSetting& setting) const override {
    return leadingResponse(coil_, setting.tracker_from_sensor, radius_squared_m2_);
  }

 private:
  Coil coil_;
  double radius_squared_m2_;
};

/// Rings as they are.
class Rings final : public field::PhysicalEffect {
 public:
  Rings(Coil coil, const Eigen::Vector3d& radius_m) : coil_(coil), radius_m_(radius_m) {}

  field::EffectResponse at(const field::SensorSetting& setting) const override {
    const Eigen::Vector3d& p_m = setting.tracker_from_sensor.position_m;
    const Eigen::Matrix3d R = setting.tracker_from_sensor.orientation.toRotationMatrix();
    Eigen::Matrix3d field;
    for (int i = 0; i < 3; ++i) {
      const double a_m = radius_m_[i];
      if (coil_ == Coil::kTransmitter) {
        field.col(i) = 4.0 / (a_m * a_m) * ringField_per_m(p_m, Eigen::Vector3d::Unit(i), a_m);
      } else {
        field.row(i) = 4.0 / (a_m * a_m) * ringField_per_m(-p_m, R.col(i), a_m).transpose();
      }
    }
    if (coil_ == Coil::kReceiver) field = R * field;
    field::EffectResponse response;
    response.field_per_m3 = field - field::dipoleField(p_m, 1.0);
    return response;
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override { return p_sensor_m.norm() > radius_m_.maxCoeff(); }

 private:
  Coil coil_;
  Eigen::Vector3d radius_m_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  const Coil coil = parameters.at("coil") == "transmitter" ? Coil::kTransmitter : Coil::kReceiver;
  const nlohmann::json& squared = parameters.at("radius_squared_m2");
  if (!squared.is_null()) return std::make_unique<SmallCoils>(coil, squared.get<double>());
  const Eigen::Vector3d radius_m = vectorOf(parameters, "radius_m");
  const double square_half_side = parameters.at("shape") == "square" ? std::sqrt(4.0 / 3.0) : 1.0;
  return std::make_unique<Rings>(coil, square_half_side * radius_m);
}

constexpr double kLargestBelievable_m = 0.25;

class FiniteCoilFit final : public EffectFit {
 public:
  explicit FiniteCoilFit(Coil coil) : coil_(coil) {}

  std::string name() const override { return nameOf(coil_); }
  std::vector<FitParameter> linear() const override {
    return {{"radius_squared_m2", "m^2", 0.0, kLargestBelievable_m * kLargestBelievable_m}};
  }

  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& /*searched*/,
               std::span<field::EffectResponse> responses) const override {
    for (std::size_t i = 0; i < at.size(); ++i) responses[i] = leadingResponse(coil_, at[i].tracker_from_sensor, 1.0);
  }

  FittedEffect describe(const Eigen::VectorXd& /*searched*/, const Eigen::VectorXd& linear) const override {
    FittedEffect fitted;
    fitted.parameters = {{"coil", nameOf(coil_)}, {"radius_squared_m2", linear[0]}};
    fitted.values = {{"radius_squared_m2", "m^2", linear[0]}};
    const double radius_m = std::sqrt(std::abs(linear[0]));
    fitted.is_plausible = linear[0] >= 0.0 && radius_m <= kLargestBelievable_m;
    if (linear[0] < 0.0) {
      fitted.doubt = std::string(nameOf(coil_)) + " coils smaller than a point";
    } else if (!fitted.is_plausible) {
      fitted.doubt =
          std::string(nameOf(coil_)) + " coils of " + formatNumber(std::round(100.0 * radius_m) / 100.0) + " m radius";
    }
    return fitted;
  }

 private:
  Coil coil_;
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& /*design*/) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(std::make_unique<FiniteCoilFit>(Coil::kTransmitter));
  ways.push_back(std::make_unique<FiniteCoilFit>(Coil::kReceiver));
  return ways;
}

}  // namespace
}  // namespace finite_coil

/// Coils of real size where the tracker's electronics believe in dipoles.
///
/// Three concentric rings of radius a stand in for the transmitter's or the receiver's coils, each with the dipole
/// moment (or the effective area) that the tracker was calibrated for. A transmitter ring of axis k has the field of
/// unit current 4 h(p)/a^2 for C = 1; a receiver ring reads, by reciprocity, 4 h(t)/a^2. To leading order in a/r
///   dS_ik = -(a^2/8) D(e_i, e_k, e_k, e_k) for transmitter rings, D(e_i, e_i, e_i, e_k) for receiver rings,
/// with D the fourth derivative of 1/r at the sensor; a square coil of half side b acts as a = sqrt(4/3) b.
/// @source Jackson 1999, Classical Electrodynamics, section 5.5 (ring) and its expansion in a/r; square: second moment
/// of the wound area
Effect finiteCoilEffect() {
  using namespace finite_coil;
  Effect effect;
  effect.id = "finite_coil";
  effect.label = "Coils of real size";
  effect.source = "Jackson 1999, Classical Electrodynamics, section 5.5 (field of a current ring), expanded in a/r";
  effect.parameters = {
      declare::choice("coil", {"transmitter", "receiver"}, "transmitter",
                      "Whose coils have size, the `transmitter`'s or the `receiver`'s."),
      declare::vector3("radius_m", {1e-4, 1.0, "m"}, {0.05, 0.05, 0.05},
                       "Of the coil about x, y and z: radius of a ring, or half the side of a square.")
          .plausibly(0.003, 0.15),
      declare::choice(
          "shape", {"ring", "square"}, "ring",
          "Form of the coils, `ring` or `square`; a square acts as the ring of the same second moment of area."),
      declare::number(
          "radius_squared_m2", {-1.0, 1.0, "m^2"}, nullptr,
          "Mean square radius of three coils alike, to leading order in radius over range; when given, radius and "
          "shape are not used. Below 0 stands for coils wound to cancel more than their own size.")
          .plausibly(0.0, 0.0225)};
  effect.make = make;
  effect.fits = fits;
  return effect;
}

}  // namespace fieldtrue::effects
