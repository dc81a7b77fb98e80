#include "calib/identify/physics_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "calib/core/statistics.h"
#include "calib/effects/registry.h"
#include "calib/field/tracker_model.h"
#include "calib/identify/selection.h"
#include "calib/recording/cleaning.h"

namespace fieldtrue::identify {

ScenePositions::ScenePositions(PositionScene scene)
    : scene_(std::move(scene)), reference_from_tracker_(inverse(scene_.tracker_from_reference)) {}

Result<ScenePositions> ScenePositions::make(PositionScene scene) {
  ScenePositions positions(std::move(scene));
  FT_TRY(positions.effects_, simulation::makeEffects(positions.scene_.effects));
  for (const Eigen::Vector3d& p_m : positions.scene_.places_m) {
    const auto report_m = positions.trackedPosition_m(p_m, positions.scene_.tracker_from_reference * p_m);
    positions.reports_m_.push_back(
        report_m.value_or(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())));
  }
  return positions;
}

std::optional<Eigen::Vector3d> ScenePositions::trackedPosition_m(const Eigen::Vector3d& p_true_m,
                                                                 const Eigen::Vector3d& near_m) const {
  field::SensorSetting setting;
  setting.tracker_from_reference = scene_.tracker_from_reference;
  setting.tracker_from_sensor = {scene_.tracker_from_reference * p_true_m, scene_.tracker_from_sensor};
  const Eigen::Vector3d& p_m = setting.tracker_from_sensor.position_m;
  if (!p_m.allFinite() || p_m.isZero()) return std::nullopt;
  field::EffectResponse sum;
  for (const auto& effect : effects_) {
    if (!effect->admits(p_m)) return std::nullopt;
    field::add(effect->at(setting), 1.0, sum);
  }
  const auto reported = field::reportedPose(setting, sum, near_m);
  if (!reported || !reported->position_m.allFinite()) return std::nullopt;
  return reported->position_m;
}

Eigen::Vector3d ScenePositions::startFor_m(const Eigen::Vector3d& p_tracked_m) const {
  double least_m2 = std::numeric_limits<double>::infinity();
  std::size_t nearest = reports_m_.size();
  for (std::size_t i = 0; i < reports_m_.size(); ++i) {
    const double apart_m2 = (reports_m_[i] - p_tracked_m).squaredNorm();
    if (!(apart_m2 < least_m2)) continue;
    least_m2 = apart_m2;
    nearest = i;
  }
  if (nearest == reports_m_.size()) return reference_from_tracker_ * p_tracked_m;
  const Eigen::Vector3d& place_m = scene_.places_m[nearest];
  const Eigen::Vector3d shifted_m = place_m + reference_from_tracker_.orientation * (p_tracked_m - reports_m_[nearest]);
  return trackedPosition_m(shifted_m, p_tracked_m) ? shifted_m : place_m;
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
  Eigen::Vector3d p_m = startFor_m(p_tracked_m);
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

/// How an effect moves the reported position of a setting through the field, to first order [m].
Eigen::Vector3d moveOf_m(const field::PhysicalEffect& effect, const field::SensorSetting& setting) {
  const field::EffectResponse response = effect.at(setting);
  return field::poseByField(setting.tracker_from_sensor.position_m).topRows<3>() *
         Eigen::Map<const Eigen::Matrix<double, 9, 1>>(response.field_per_m3.data());
}

/// The setting with the mean orientation, without grid index and time: what is known when only a position is.
field::SensorSetting atMeanOrientation(const field::SensorSetting& setting,
                                       const Eigen::Quaterniond& tracker_from_sensor) {
  field::SensorSetting mean;
  mean.tracker_from_reference = setting.tracker_from_reference;
  mean.tracker_from_sensor = {setting.tracker_from_sensor.position_m, tracker_from_sensor};
  return mean;
}

/// Whether an effect is a function of position: it acts through the field, and the displacement it causes changes by at
/// most a tenth when the orientation, index and time of the sensor do. What moves the sensor off its stated place is
/// the rig's error and not the tracker's.
bool dependsOnPositionOnly(const field::PhysicalEffect& effect, std::span<const field::SensorSetting> settings,
                           const Eigen::Quaterniond& tracker_from_sensor) {
  constexpr double kLargestShare = 0.1;
  double sum_m2 = 0.0;
  double other_m2 = 0.0;
  for (const field::SensorSetting& setting : settings) {
    if (!effect.at(setting).shift_m.isZero()) return false;
    const Eigen::Vector3d move_m = moveOf_m(effect, setting);
    sum_m2 += move_m.squaredNorm();
    other_m2 += (move_m - moveOf_m(effect, atMeanOrientation(setting, tracker_from_sensor))).squaredNorm();
  }
  return std::isfinite(sum_m2) && sum_m2 > 0.0 && other_m2 <= kLargestShare * kLargestShare * sum_m2;
}

std::vector<Eigen::Quaterniond> orientationsOf(std::span<const field::SensorSetting> settings) {
  std::vector<Eigen::Quaterniond> orientations;
  for (const field::SensorSetting& setting : settings) orientations.push_back(setting.tracker_from_sensor.orientation);
  return orientations;
}

simulation::EffectInstance instanceOf(const GapTerm& term) {
  return {term.effect->id, term.fit->describe(term.searched, term.linear).parameters};
}

/// The terms of a model that are functions of position.
std::vector<std::size_t> positionTerms(const GapModel& model, std::span<const field::SensorSetting> settings) {
  const Eigen::Quaterniond tracker_from_sensor = meanRotation(orientationsOf(settings));
  std::vector<std::size_t> terms;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const simulation::EffectInstance instance = instanceOf(model.terms[t]);
    const auto effect = effects::makeEffect(instance.id, instance.parameters);
    if (effect && dependsOnPositionOnly(**effect, settings, tracker_from_sensor)) terms.push_back(t);
  }
  return terms;
}

Result<ScenePositions> positionsOf(const GapPhysics& physics, const GapModel& model,
                                   std::span<const std::size_t> terms) {
  PositionScene scene;
  scene.tracker_from_reference = model.alignment.tracker_from_reference;
  scene.tracker_from_sensor = meanRotation(orientationsOf(physics.settings(model.alignment)));
  for (const std::size_t t : terms) scene.effects.push_back(instanceOf(model.terms[t]));
  for (const GapRow& row : physics.rows().rows) scene.places_m.push_back(row.reference_from_sensor.position_m);
  return ScenePositions::make(std::move(scene));
}

bool explainsEveryReading(const ScenePositions& positions, const GapRows& rows) {
  for (const GapRow& row : rows.rows)
    if (!positions.truePosition_m(row.tracker_from_sensor.position_m)) return false;
  return true;
}

/// The model refitted with each fold left out, its effects as all rows chose them.
Result<std::vector<ScenePositions>> refitted(const GapSearch& search, const GapModel& model,
                                             std::span<const std::size_t> terms, const std::map<int, int>& fold_of_node,
                                             const RunControl& control) {
  int folds = 0;
  for (const auto& [node, fold] : fold_of_node) folds = std::max(folds, fold + 1);
  const std::vector<GapRow>& rows = search.physics().rows().rows;
  std::vector<GapModel> models(static_cast<std::size_t>(folds));
  control.parallel_for(models.size(), [&](std::size_t fold) {
    std::vector<char> used;
    for (const GapRow& row : rows) used.push_back(fold_of_node.at(row.node) != static_cast<int>(fold) ? 1 : 0);
    models[fold] = search.fitted(model, used);
  });
  std::vector<ScenePositions> scenes;
  for (const GapModel& one : models) {
    FT_TRY(auto scene, positionsOf(search.physics(), one, terms));
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

Result<GapRows> rowsOf(const CalibrationTable& table) {
  return makeGapRows(recording::cleanRows(table).nodes, table.metadata);
}

CalibrationTable searchedPart(CalibrationTable table, const std::set<int>& searched_nodes) {
  if (!searched_nodes.empty())
    std::erase_if(table.nodes, [&](const Node& node) { return searched_nodes.count(node.node) == 0; });
  return table;
}

/// The model's parameters as all rows have them, with the noise found in those searched.
GapModel refinedOn(const GapRows& rows, const GapSearch& search, const GapModel& model) {
  if (rows.rows.size() == search.physics().size()) return model;
  const Whitening whitening = makeWhitening(rows, search.placingSd_m(), search.placingSd_rad());
  return fitJointly(GapPhysics(rows, {}), model, whitening, {search.law()});
}

PhysicsFit noPhysics(PhysicsFit fit, std::string why) {
  fit.positions.reset();
  fit.without_fold.clear();
  fit.named.clear();
  fit.why_none = std::move(why);
  return fit;
}

}  // namespace

Result<PhysicsFit> fitPhysics(const CalibrationTable& table, const PhysicsFitOptions& options,
                              const RunControl& control) {
  const auto all = rowsOf(table);
  const auto rows = rowsOf(searchedPart(table, options.searched_nodes));
  if (!all || !rows || rows->place_nodes.size() < Thresholds{}.fewest_places_for_causes)
    return noPhysics({}, "there are fewer places than a cause can be told from");
  const GapSearch search(*rows, {});
  EffectSelectionOptions selecting;
  selecting.most_effects = options.most_effects;
  const EffectSelection selection = selectEffects(search, selecting, control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  const GapModel& model = selection.model.model;
  PhysicsFit fit;
  if (model.terms.empty()) return noPhysics(std::move(fit), "no known effect stands out of the noise");
  const std::vector<std::size_t> terms = positionTerms(model, search.physics().settings(model.alignment));
  for (std::size_t t = 0; t < model.terms.size(); ++t)
    (std::count(terms.begin(), terms.end(), t) > 0 ? fit.named : fit.left_out).push_back(model.terms[t].effect->id);
  if (terms.empty())
    return noPhysics(std::move(fit), "what stands out is an error of the rig, or depends on more than the position");
  auto positions = positionsOf(search.physics(), refinedOn(*all, search, model), terms);
  auto scenes = refitted(search, model, terms, options.fold_of_node, control);
  if (!positions || !scenes || !explainsEveryReading(*positions, *all))
    return noPhysics(std::move(fit), "the fitted scene has no place for some of the readings");
  fit.positions = *std::move(positions);
  fit.without_fold = *std::move(scenes);
  return fit;
}

}  // namespace fieldtrue::identify
