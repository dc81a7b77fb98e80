#include "widgets/figures/gap_bodies.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/effects/registry.h"
#include "widgets/figures/gap_bars.h"

namespace fieldtrue::widgets {
namespace {

/// A ball that holds 90 % of a normal distribution in space: the root of chi-square's 0.9 quantile, 3 degrees of
/// freedom.
constexpr double kBall90 = 2.500;

Eigen::Matrix3d halfAxes90(const Eigen::Matrix3d& covariance_m2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance_m2);
  return axes.eigenvectors() * (kBall90 * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt()).asDiagonal();
}

/// Ends of a plane's distance, from where it is believed to be.
void addDistanceRange(const gap::GapCandidate& plane, BelievedBody& body) {
  for (const gap::Estimate& estimate : plane.parameters) {
    if (estimate.name != "distance_m") continue;
    if (estimate.low90) body.nearest_m = *estimate.low90 - estimate.value;
    if (estimate.high90) body.farthest_m = *estimate.high90 - estimate.value;
  }
}

/// Tracker frame.
BelievedBody bodyOf(const gap::GapCandidate& candidate, const effects::EffectBody& shape) {
  BelievedBody body;
  body.shape = shape.shape;
  body.name = effectLabel(candidate.effect);
  body.center_m = *candidate.location_m;
  body.normal = shape.normal;
  body.side = shape.side;
  body.radius_m = shape.radius_m;
  body.length_m = shape.length_m;
  body.width_m = shape.width_m;
  if (candidate.location_covariance_m2 && candidate.location_covariance_m2->allFinite())
    body.region_m = halfAxes90(*candidate.location_covariance_m2);
  if (body.shape == effects::DrawnShape::kPlane) addDistanceRange(candidate, body);
  return body;
}

}  // namespace

std::vector<BelievedBody> believedBodies(const gap::GapReport& report) {
  const Pose reference_from_tracker = inverse(report.tracker_from_reference);
  const Eigen::Matrix3d turn = reference_from_tracker.orientation.toRotationMatrix();
  std::vector<BelievedBody> bodies;
  for (const gap::SelectedEffect& effect : report.selected) {
    if (!effect.location_m || !effect.location_m->allFinite()) continue;
    const auto row = effects::findEffect(effect.effect);
    if (!row || (*row)->body == nullptr) continue;
    BelievedBody body = bodyOf(effect, (*row)->body(effect.scene_parameters));
    body.center_m = reference_from_tracker * body.center_m;
    body.normal = turn * body.normal;
    body.side = turn * body.side;
    body.region_m = turn * body.region_m;
    bodies.push_back(std::move(body));
  }
  return bodies;
}

}  // namespace fieldtrue::widgets
