#include "calib/gap/physics_fit.h"

#include <Eigen/LU>
#include <cmath>

#include "calib/core/statistics.h"
#include "calib/effects/registry.h"
#include "calib/field/coupling.h"
#include "calib/field/pose_solver.h"
#include "calib/gap/cleaning.h"
#include "calib/gap/gap_search.h"

namespace fieldtrue {

ScenePositions::ScenePositions(PositionScene scene)
    : scene_(std::move(scene)), reference_from_tracker_(inverse(scene_.tracker_from_reference)) {}

Result<ScenePositions> ScenePositions::make(PositionScene scene) {
  ScenePositions positions(std::move(scene));
  for (const EffectInstance& instance : positions.scene_.effects) {
    auto effect = makeEffect(instance.id, instance.parameters);
    if (!effect) return tl::unexpected<Error>(effect.error());
    positions.effects_.push_back(*std::move(effect));
  }
  return positions;
}

std::optional<Eigen::Vector3d> ScenePositions::trackedPosition_m(const Eigen::Vector3d& p_true_m,
                                                                 const Eigen::Vector3d& near_m) const {
  SensorSetting setting;
  setting.tracker_from_reference = scene_.tracker_from_reference;
  setting.tracker_from_sensor = {scene_.tracker_from_reference * p_true_m, scene_.tracker_from_sensor};
  Eigen::Vector3d p_m = setting.tracker_from_sensor.position_m;
  if (!p_m.allFinite() || p_m.isZero()) return std::nullopt;
  Eigen::Matrix3d change_per_m3 = Eigen::Matrix3d::Zero();
  for (const auto& effect : effects_) {
    if (!effect->admits(setting.tracker_from_sensor.position_m)) return std::nullopt;
    const EffectResponse response = effect->at(setting);
    p_m += response.shift_m;
    change_per_m3 += response.field_per_m3;
  }
  // The sensor's orientation turns the couplings' rows and leaves the solved position as it is.
  const auto solution = solvePose(Eigen::Matrix3d(dipoleField(p_m, 1.0) + change_per_m3), 1.0, near_m);
  if (!solution || !solution->tracker_from_sensor.position_m.allFinite()) return std::nullopt;
  return solution->tracker_from_sensor.position_m;
}

std::optional<Eigen::Vector3d> ScenePositions::truePosition_m(const Eigen::Vector3d& p_tracked_m) const {
  constexpr double kTolerance_m = 1e-9;
  constexpr double kDifference_m = 1e-5;
  constexpr int kMostSteps = 25;
  constexpr int kMostHalvings = 8;
  const double near_enough_m = kTolerance_m + 1e-13 * p_tracked_m.norm();
  const auto missBy_m = [&](const Eigen::Vector3d& p_m) -> std::optional<Eigen::Vector3d> {
    const auto seen_m = trackedPosition_m(p_m, p_tracked_m);
    if (!seen_m) return std::nullopt;
    return Eigen::Vector3d(p_tracked_m - *seen_m);
  };
  Eigen::Vector3d p_m = reference_from_tracker_ * p_tracked_m;
  auto miss_m = missBy_m(p_m);
  for (int step = 0; miss_m && step < kMostSteps; ++step) {
    if (miss_m->norm() <= near_enough_m) return p_m;
    Eigen::Matrix3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      const auto beside_m = missBy_m(p_m + kDifference_m * Eigen::Vector3d::Unit(axis));
      if (!beside_m) return std::nullopt;
      slope.col(axis) = (*miss_m - *beside_m) / kDifference_m;
    }
    Eigen::Vector3d move_m = slope.partialPivLu().solve(*miss_m);
    if (!move_m.allFinite()) return std::nullopt;
    std::optional<Eigen::Vector3d> left_m;
    for (int halving = 0; halving < kMostHalvings; ++halving, move_m *= 0.5) {
      left_m = missBy_m(p_m + move_m);
      if (left_m && left_m->norm() < miss_m->norm()) break;
      left_m.reset();
    }
    if (!left_m) return std::nullopt;
    p_m += move_m;
    miss_m = left_m;
  }
  return std::nullopt;
}

namespace {

/// How an effect moves the reported position of a setting, to first order [m].
Eigen::Vector3d moveOf_m(const PhysicalEffect& effect, const SensorSetting& setting) {
  const EffectResponse response = effect.at(setting);
  return response.shift_m + poseByField(setting.tracker_from_sensor.position_m).topRows<3>() *
                                Eigen::Map<const Eigen::Matrix<double, 9, 1>>(response.field_per_m3.data());
}

/// A setting as a position alone tells it.
SensorSetting reduced(const SensorSetting& setting, const Eigen::Quaterniond& tracker_from_sensor) {
  SensorSetting told;
  told.tracker_from_reference = setting.tracker_from_reference;
  told.tracker_from_sensor = {setting.tracker_from_sensor.position_m, tracker_from_sensor};
  return told;
}

bool isToldByPosition(const PhysicalEffect& effect, std::span<const SensorSetting> settings,
                      const Eigen::Quaterniond& tracker_from_sensor) {
  constexpr double kMostUntold = 0.1;
  double sum_m2 = 0.0;
  double untold_m2 = 0.0;
  for (const SensorSetting& setting : settings) {
    const Eigen::Vector3d move_m = moveOf_m(effect, setting);
    sum_m2 += move_m.squaredNorm();
    untold_m2 += (move_m - moveOf_m(effect, reduced(setting, tracker_from_sensor))).squaredNorm();
  }
  return std::isfinite(sum_m2) && sum_m2 > 0.0 && untold_m2 <= kMostUntold * kMostUntold * sum_m2;
}

/// The scene of a fitted model, with the effects that a position tells.
PositionScene sceneOf(const GapModel& model, std::span<const SensorSetting> settings, PhysicsFit& fit) {
  PositionScene scene;
  scene.tracker_from_reference = model.alignment.tracker_from_reference;
  std::vector<Eigen::Quaterniond> orientations;
  for (const SensorSetting& setting : settings) orientations.push_back(setting.tracker_from_sensor.orientation);
  scene.tracker_from_sensor = meanRotation(orientations);
  for (const GapTerm& term : model.terms) {
    const EffectInstance instance{term.effect->id, term.fit->describe(term.searched, term.linear).parameters};
    const auto effect = makeEffect(instance.id, instance.parameters);
    if (effect && isToldByPosition(**effect, settings, scene.tracker_from_sensor)) {
      fit.named.push_back(instance.id);
      scene.effects.push_back(instance);
    } else {
      fit.left_out.push_back(instance.id);
    }
  }
  return scene;
}

bool explainsEveryReading(const ScenePositions& positions, const GapRows& rows) {
  for (const GapRow& row : rows.rows)
    if (!positions.truePosition_m(row.tracker_from_sensor.position_m)) return false;
  return true;
}

PhysicsFit noPhysics(PhysicsFit fit, std::string why) {
  fit.positions.reset();
  fit.named.clear();
  fit.why_none = std::move(why);
  return fit;
}

}  // namespace

Result<PhysicsFit> fitPhysics(const CalibrationTable& table, int most_effects, const RunControl& control) {
  const auto rows = makeGapRows(cleanRows(table).nodes, table.metadata);
  if (!rows) return noPhysics({}, "there are fewer places than a cause can be told from");
  const GapSearch search(*rows, {});
  SelectionOptions options;
  options.most_effects = most_effects;
  const Selection selection = selectEffects(search, options, control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  const GapModel& model = selection.model.model;
  PhysicsFit fit;
  if (model.terms.empty()) return noPhysics(std::move(fit), "no known effect stands out of the noise");
  PositionScene scene = sceneOf(model, search.physics().settings(model.alignment), fit);
  if (scene.effects.empty())
    return noPhysics(std::move(fit), "what stands out is not told by the position of a reading alone");
  auto positions = ScenePositions::make(std::move(scene));
  if (!positions) return tl::unexpected<Error>(positions.error());
  if (!explainsEveryReading(*positions, *rows))
    return noPhysics(std::move(fit), "the fitted scene has no place for some of the readings");
  fit.positions = *std::move(positions);
  return fit;
}

}  // namespace fieldtrue
