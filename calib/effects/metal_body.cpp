#include "calib/effects/metal_body.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/effects/compact_metal.h"
#include "calib/effects/parameters.h"
#include "calib/field/metal_response.h"

namespace fieldtrue::effects {

namespace {

constexpr double kLargestBelievable_m = 0.6;
/// Eigenvalues of the other sign below this share of the largest are noise.
constexpr double kMixedShare = 0.15;

Eigen::Vector3d eigenvaluesOf(const Eigen::Matrix3d& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

/// No body answers more strongly than the permeable sphere of A = 4 pi a^3: one of polarizability A is at least this
/// big.
double smallestRadius_m(const Eigen::Matrix3d& polarizability_m3) {
  return std::cbrt(eigenvaluesOf(polarizability_m3).cwiseAbs().maxCoeff() / (4.0 * kPi));
}

Eigen::Matrix3d matrixOf(const nlohmann::json& list) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = list.at(static_cast<std::size_t>(i)).get<double>();
  return matrix;
}

double sphereOf(const nlohmann::json& parameters, const field::Excitation& excitation, double radius_m) {
  const double mu_r = scalarOf(parameters, "relative_permeability");
  const bool is_ferromagnetic = isFerromagnetic(parameters);
  const nlohmann::json& conductivity = parameters.at("conductivity_s_per_m");
  if (conductivity.is_null()) return spherePolarizability_m3(radius_m, is_ferromagnetic, mu_r);
  const field::Metal metal{conductivity.get<double>(), is_ferromagnetic ? mu_r : 1.0};
  return (4.0 * kPi) / 3.0 * radius_m * radius_m * radius_m * field::sphereSusceptibility(radius_m, metal, excitation);
}

Eigen::Matrix3d tensorOf(BodyShape shape, const Eigen::VectorXd& linear) {
  if (shape == BodyShape::kSphere) return linear[0] * Eigen::Matrix3d::Identity();
  Eigen::Matrix3d A;
  A << linear[0], linear[3], linear[4], linear[3], linear[1], linear[5], linear[4], linear[5], linear[2];
  return A;
}

std::string materialOf(const Eigen::Vector3d& eigenvalues) {
  const double largest = eigenvalues.cwiseAbs().maxCoeff();
  if (eigenvalues.maxCoeff() <= kMixedShare * largest) return "conductive";
  return eigenvalues.minCoeff() >= -kMixedShare * largest ? "ferromagnetic" : "undetermined";
}

/// Why such a body cannot be there; empty when it can.
std::string doubtOf(double radius_m, double clearance_m) {
  if (radius_m > kLargestBelievable_m) {
    return "a compact body as strong as a metal sphere of " + formatNumber(std::round(radius_m * 100.0) / 100.0) +
           " m radius";
  }
  if (radius_m > clearance_m) {
    return "a metal sphere of " + formatNumber(std::round(radius_m * 100.0) / 100.0) +
           " m radius would reach a place of the sensor " + formatNumber(std::round(clearance_m * 100.0) / 100.0) +
           " m from its centre";
  }
  return {};
}

}  // namespace

Eigen::Matrix3d MetalBody::fieldChange_per_m3(const Eigen::Vector3d& p_sensor_m) const {
  return field::dipoleField(p_sensor_m - center_m, 1.0) * polarizability_m3 *
         field::dipoleField(center_m, 1.0 / (4.0 * kPi));
}

std::vector<Setting> bodyParameters() {
  return {centerParameter("Middle of the body, tracker frame."),
          declare::number("radius_m", {0.001, 10.0, "m"}, 0.1, "Radius of a sphere that answers as the body does.")
              .plausibly(0.02, 0.5),
          materialParameter(),
          permeabilityParameter(),
          conductivityParameter(
              "Of a solid sphere: aluminium 3.5e7, copper 5.8e7, steel 6e6, stainless 1.4e6. When given, the tracker's "
              "carrier or sampling delay decides how much is left of the ideal answer; null is an ideal metal."),
          declare::matrix3("polarizability_m3", {-1e4, 1e4, "m^3"},
                           "Induced moment per field, tracker axes; when given, radius, material, permeability and "
                           "conductivity are not used.")
              .plausibly(-0.8, 1.6)};
}

Result<MetalBody> bodyOf(const nlohmann::json& parameters, const field::Excitation& excitation,
                         const std::string& effect_id) {
  MetalBody body;
  body.center_m = vectorOf(parameters, "center_m");
  body.radius_m = scalarOf(parameters, "radius_m");
  if (parameters.at("polarizability_m3").is_null()) {
    body.polarizability_m3 = sphereOf(parameters, excitation, body.radius_m) * Eigen::Matrix3d::Identity();
  } else {
    body.polarizability_m3 = matrixOf(parameters.at("polarizability_m3"));
    body.radius_m = smallestRadius_m(body.polarizability_m3);
  }
  if (body.center_m.norm() <= body.radius_m) {
    return fail(ErrorCode::kBadInput, effect_id + ": center_m " + textOf(body.center_m) +
                                          " puts the transmitter inside the body, which has a radius of " +
                                          formatNumber(body.radius_m) +
                                          " m; the centre must be farther from the transmitter.");
  }
  return body;
}

std::vector<FitParameter> polarizabilityParameters(BodyShape shape) {
  const double low_m3 = spherePolarizability_m3(kLargestBelievable_m, false, 1.0);
  const double high_m3 = -low_m3;
  if (shape == BodyShape::kSphere) return {{"polarizability_m3", "m^3", low_m3, high_m3}};
  std::vector<FitParameter> parameters;
  for (const char* component : {"xx", "yy", "zz", "xy", "xz", "yz"}) {
    parameters.push_back({std::string("polarizability_") + component + "_m3", "m^3", low_m3, high_m3});
  }
  return parameters;
}

void respondAsBody(BodyShape shape, const Eigen::Vector3d& center_m, const Eigen::Matrix3d& field_of_transmitter,
                   const Eigen::Vector3d& p_sensor_m, std::span<field::EffectResponse> responses) {
  const Eigen::Matrix3d from_body = field::dipoleField(p_sensor_m - center_m, 1.0);
  for (field::EffectResponse& response : responses) response.shift_m = response.turn_rad = Eigen::Vector3d::Zero();
  if (shape == BodyShape::kSphere) {
    responses[0].field_per_m3 = from_body * field_of_transmitter;
    return;
  }
  const auto dyad = [&](int a, int b) -> Eigen::Matrix3d {
    return from_body.col(a).lazyProduct(field_of_transmitter.row(b));
  };
  for (int a = 0; a < 3; ++a) responses[static_cast<std::size_t>(a)].field_per_m3 = dyad(a, a);
  responses[3].field_per_m3 = dyad(0, 1) + dyad(1, 0);
  responses[4].field_per_m3 = dyad(0, 2) + dyad(2, 0);
  responses[5].field_per_m3 = dyad(1, 2) + dyad(2, 1);
}

FittedEffect describeBody(BodyShape shape, const Eigen::Vector3d& center_m, const Eigen::VectorXd& linear,
                          const RoomSearch& search) {
  const Eigen::Matrix3d A = tensorOf(shape, linear);
  const Eigen::Vector3d eigenvalues = eigenvaluesOf(A);
  const double conducting_radius_m = std::cbrt(eigenvalues.cwiseAbs().maxCoeff() / (0.5 * (4.0 * kPi)));
  FittedEffect fitted;
  fitted.location_m = center_m;
  fitted.material = materialOf(eigenvalues);
  const char* const scene_material = eigenvalues.sum() > 0.0 ? "ferromagnetic" : "conductive";
  fitted.parameters = {
      {"center_m", {center_m.x(), center_m.y(), center_m.z()}},
      {"radius_m", std::clamp(conducting_radius_m, 0.001, 10.0)},
      {"material", scene_material},
      {"polarizability_m3", {A(0, 0), A(0, 1), A(0, 2), A(1, 0), A(1, 1), A(1, 2), A(2, 0), A(2, 1), A(2, 2)}}};
  const char* const kCenter[] = {"center_x_m", "center_y_m", "center_z_m"};
  for (int i = 0; i < 3; ++i) fitted.values.push_back({kCenter[i], "m", center_m[i]});
  fitted.values.push_back({"polarizability_m3", "m^3", A.trace() / 3.0});
  fitted.values.push_back({"radius_m", "m", conducting_radius_m});
  if (shape == BodyShape::kTensor) {
    const std::vector<FitParameter> names = polarizabilityParameters(shape);
    for (std::size_t i = 0; i < names.size(); ++i) {
      fitted.values.push_back({names[i].name, "m^3", linear[static_cast<Eigen::Index>(i)]});
    }
  }
  fitted.doubt = doubtOf(conducting_radius_m, std::min(search.nearestPlace_m(center_m), center_m.norm()));
  fitted.is_plausible = fitted.doubt.empty();
  return fitted;
}

}  // namespace fieldtrue::effects
