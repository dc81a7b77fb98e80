#include "widgets/views/gap_bodies.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "widgets/views/gap_bars.h"

namespace fieldtrue {
namespace {

/// A ball that holds 90 % of a normal distribution in space: the root of chi-square's 0.9 quantile, 3 degrees of
/// freedom.
constexpr double kBall90 = 2.500;

std::optional<Eigen::Vector3d> directionIn(const nlohmann::json& parameters, const char* key) {
  if (!parameters.is_object() || !parameters.contains(key) || !parameters[key].is_array()) return std::nullopt;
  const Eigen::Vector3d v(parameters[key][0], parameters[key][1], parameters[key][2]);
  return v.norm() > 0.0 ? std::optional<Eigen::Vector3d>(v.normalized()) : std::nullopt;
}

double lengthIn(const nlohmann::json& parameters, const char* key) {
  if (!parameters.is_object() || !parameters.contains(key) || !parameters[key].is_number()) return 0.0;
  return parameters[key];
}

Eigen::Matrix3d halfAxes90(const Eigen::Matrix3d& covariance_m2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance_m2);
  return axes.eigenvectors() * (kBall90 * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt()).asDiagonal();
}

/// Tracker frame.
BelievedBody bodyOf(const GapCandidate& effect) {
  const nlohmann::json& parameters = effect.scene_parameters;
  BelievedBody body;
  body.name = effectLabel(effect.effect);
  body.center_m = *effect.location_m;
  if (effect.location_covariance_m2 && effect.location_covariance_m2->allFinite())
    body.region_m = halfAxes90(*effect.location_covariance_m2);
  if (const auto toward = directionIn(parameters, "toward")) {
    body.kind = BodyKind::kPlane;
    body.normal = *toward;
    const double distance_m = lengthIn(parameters, "distance_m");
    for (const Estimate& estimate : effect.parameters) {
      if (estimate.name != "distance_m") continue;
      if (estimate.low90) body.nearest_m = *estimate.low90 - distance_m;
      if (estimate.high90) body.farthest_m = *estimate.high90 - distance_m;
    }
    return body;
  }
  body.radius_m = lengthIn(parameters, "radius_m");
  const auto normal = directionIn(parameters, "normal");
  if (!normal) return body;
  body.normal = *normal;
  const auto side = directionIn(parameters, "side");
  body.kind = side ? BodyKind::kPlate : BodyKind::kLoop;
  if (!side) return body;
  body.side = (*side - side->dot(*normal) * *normal).normalized();
  body.length_m = lengthIn(parameters, "length_m");
  body.width_m = lengthIn(parameters, "width_m");
  return body;
}

}  // namespace

std::vector<BelievedBody> believedBodies(const GapReport& report) {
  const Pose reference_from_tracker = inverse(report.tracker_from_reference);
  const Eigen::Matrix3d turn = reference_from_tracker.orientation.toRotationMatrix();
  std::vector<BelievedBody> bodies;
  for (const SelectedEffect& effect : report.selected) {
    if (!effect.location_m || !effect.location_m->allFinite()) continue;
    BelievedBody body = bodyOf(effect);
    body.center_m = reference_from_tracker * body.center_m;
    body.normal = turn * body.normal;
    body.side = turn * body.side;
    body.region_m = turn * body.region_m;
    bodies.push_back(std::move(body));
  }
  return bodies;
}

}  // namespace fieldtrue
