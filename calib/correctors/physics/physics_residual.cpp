#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/fit_rows.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/radial/rbf_field.h"
#include "calib/correctors/radial/rbf_system.h"
#include "calib/geometry/spacing.h"
#include "calib/identify/physics_fit.h"

namespace fieldtrue::correctors {
namespace {

const std::string kName = "Physics and residual";
const std::string kNoPlace = "the fitted scene has no place for some of the readings";
constexpr const char* kMostEffects = "most_effects";
constexpr const char* kSearchPlaces = "search_places";
/// A second effect on fewer places than two times this is fitted to their noise.
constexpr std::int64_t kPlacesPerEffect = 60;

class PhysicsResidual : public PositionModel {
 public:
  /// @param physics none where no scene was found: then the remainder is all
  /// @param note of the scene
  PhysicsResidual(std::optional<identify::ScenePositions> physics, std::unique_ptr<PositionModel> remainder,
                  std::string note)
      : physics_(std::move(physics)), remainder_(std::move(remainder)), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    if (!physics_) return remainder_->displacement_m(p_tracked_m);
    const Eigen::Vector3d p_m = physics_->truePosition_m(p_tracked_m).value_or(p_tracked_m);
    return p_m + remainder_->displacement_m(p_m) - p_tracked_m;
  }
  bool takesOrientation() const override { return remainder_->takesOrientation(); }
  Eigen::Vector3d displacementAt_m(const Pose& tracked) const override {
    const Eigen::Vector3d p_m = undistorted_m(tracked.position_m).value_or(tracked.position_m);
    return p_m + remainder_->displacementAt_m({p_m, tracked.orientation}) - tracked.position_m;
  }
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    const auto p_m = undistorted_m(p_tracked_m);
    return p_m ? remainder_->uncertainty_m(*p_m) : std::nullopt;
  }
  std::optional<double> uncertaintyAt_m(const Pose& tracked) const override {
    const auto p_m = undistorted_m(tracked.position_m);
    return p_m ? remainder_->uncertaintyAt_m({*p_m, tracked.orientation}) : std::nullopt;
  }
  /// Not where the scene has no place for the reading.
  bool covers(const Eigen::Vector3d& p_tracked_m) const override {
    const auto p_m = undistorted_m(p_tracked_m);
    return p_m && remainder_->covers(*p_m);
  }
  std::string note() const override {
    const std::string of_remainder = remainder_->note();
    return note_ + (of_remainder.empty() ? "" : " " + of_remainder);
  }
  nlohmann::json parameters() const override {
    return {{"scene", physics_ ? jsonOfScene() : nlohmann::json()},
            {"remainder", remainder_->parameters()},
            {"note", note_}};
  }

 private:
  std::optional<Eigen::Vector3d> undistorted_m(const Eigen::Vector3d& p_tracked_m) const {
    return physics_ ? physics_->truePosition_m(p_tracked_m) : p_tracked_m;
  }
  nlohmann::json jsonOfScene() const {
    nlohmann::json effects = nlohmann::json::array();
    for (const simulation::EffectInstance& effect : physics_->scene().effects)
      effects.push_back({{"id", effect.id}, {"parameters", effect.parameters}});
    Eigen::MatrixXd places_m(static_cast<Eigen::Index>(physics_->scene().places_m.size()), 3);
    for (Eigen::Index i = 0; i < places_m.rows(); ++i)
      places_m.row(i) = physics_->scene().places_m[static_cast<std::size_t>(i)].transpose();
    return {{"tracker_from_reference", jsonOf(physics_->scene().tracker_from_reference)},
            {"tracker_from_sensor_q_wxyz", jsonOf(physics_->scene().tracker_from_sensor)},
            {"effects", std::move(effects)},
            {"places_m", jsonOf(places_m)}};
  }

  std::optional<identify::ScenePositions> physics_;
  std::unique_ptr<PositionModel> remainder_;
  std::string note_;
};

/// The rows as a table whose reference frame is the aligned truth: what is left of the alignment is fitted again.
CalibrationTable tableOf(const FitData& data) {
  CalibrationTable table;
  std::map<int, int> visits;
  for (std::size_t row = 0; row < data.size(); ++row) {
    Node node;
    node.node = data.node[row];
    node.visit = visits[node.node]++;
    node.reference_from_sensor.position_m = data.p_true_m[row];
    node.tracker_from_sensor.position_m = data.p_tracked_m[row];
    node.has_orientation = data.hasOrientation();
    if (node.has_orientation) {
      node.reference_from_sensor.orientation = data.q_true[row].normalized();
      node.tracker_from_sensor.orientation = data.q_tracked[row].normalized();
    }
    if (!data.index.empty()) node.index = data.index[row];
    if (!data.noise_m2.empty()) node.covariance_m2 = data.noise_m2[row];
    table.nodes.push_back(node);
  }
  if (data.jig_sd_m > 0.0) table.metadata.jig_tolerance_m = data.jig_sd_m;
  return table;
}

/// The rows that the scene is sought in: all visits of well-spread places.
std::vector<std::size_t> searchedRows(const Places& places, std::size_t most_places) {
  std::vector<std::size_t> rows;
  for (const std::size_t place : spreadPlaces(places.p_tracked_m, most_places))
    rows.insert(rows.end(), places.rows[place].begin(), places.rows[place].end());
  std::sort(rows.begin(), rows.end());
  return rows;
}

/// The data with the scene undone: readings where the sensor would be by it, and their noise as it comes out there.
/// @return none where the scene has no place for a reading
std::optional<FitData> undone(const FitData& data, const identify::ScenePositions& physics) {
  constexpr double kDifference_m = 1e-4;
  FitData left = data;
  for (std::size_t row = 0; row < data.size(); ++row) {
    const auto p_m = physics.truePosition_m(data.p_tracked_m[row]);
    if (!p_m) return std::nullopt;
    left.p_tracked_m[row] = *p_m;
    if (data.noise_m2.empty()) continue;
    Eigen::Matrix3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      const auto beside_m = physics.truePosition_m(data.p_tracked_m[row] + kDifference_m * Eigen::Vector3d::Unit(axis));
      if (!beside_m) return std::nullopt;
      slope.col(axis) = (*beside_m - *p_m) / kDifference_m;
    }
    left.noise_m2[row] = slope * data.noise_m2[row] * slope.transpose();
  }
  return left;
}

std::string listed(const std::vector<std::string>& ids) {
  std::string text;
  for (const std::string& id : ids) text += (text.empty() ? "" : ", ") + id;
  return text;
}

Settings settingsOfRemainder(Settings settings) {
  settings.erase(kMostEffects);
  settings.erase(kSearchPlaces);
  return settings;
}

/// The model of a scene and of what it leaves of the data.
/// @error kDegenerate where the scene has no place for a reading; as the Gaussian process
Result<std::unique_ptr<PositionModel>> modelOf(const FitData& data, std::optional<identify::ScenePositions> scene,
                                               const std::string& note, const Settings& settings,
                                               const RunControl& control) {
  std::optional<FitData> left = scene ? undone(data, *scene) : data;
  if (!left) return fail(ErrorCode::kDegenerate, kName + ": " + kNoPlace);
  FT_TRY(auto remainder, gaussianProcessPosition().fit(*left, settingsOfRemainder(settings), control));
  return std::make_unique<PhysicsResidual>(std::move(scene), std::move(remainder), note);
}

/// Mean square of what a model leaves at rows it was not fitted to; a reading it cannot place is left as it is.
double heldOut_m2(const PositionModel& model, const FitData& rows) {
  double sum_m2 = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Vector3d& p_m = rows.p_tracked_m[i];
    const Eigen::Vector3d move_m = model.covers(p_m) ? model.displacement_m(p_m) : Eigen::Vector3d(0.0, 0.0, 0.0);
    sum_m2 += (p_m + move_m - rows.p_true_m[i]).squaredNorm();
  }
  return sum_m2;
}

/// Whether the scene, refitted with folds of places left out, foretells these clearly better than a Gaussian process
/// alone.
bool helpsHeldOut(const FitData& data, std::vector<identify::ScenePositions>& without_fold,
                  const std::map<int, int>& fold_of_node, const Settings& settings) {
  constexpr double kLeastGain = 0.95;  // RMS.
  Settings quick = settings;
  quick["restarts"] = std::int64_t{1};
  quick["inputs"] = std::string("position");
  double with_m2 = 0.0;
  double alone_m2 = 0.0;
  for (std::size_t fold = 0; fold < without_fold.size(); ++fold) {
    std::vector<std::size_t> kept;
    std::vector<std::size_t> out;
    for (std::size_t row = 0; row < data.size(); ++row)
      (fold_of_node.at(data.node[row]) == static_cast<int>(fold) ? out : kept).push_back(row);
    const FitData rest = rowsOfFitData(data, kept);
    const FitData rows = rowsOfFitData(data, out);
    const auto alone = modelOf(rest, std::nullopt, {}, quick, {});
    const auto with = modelOf(rest, std::move(without_fold[fold]), {}, quick, {});
    if (!alone) continue;
    if (!with) return false;
    with_m2 += heldOut_m2(**with, rows);
    alone_m2 += heldOut_m2(**alone, rows);
  }
  return with_m2 < kLeastGain * kLeastGain * alone_m2;
}

/// Folds that follow no layer of a grid, whatever its counts: multiples of the golden ratio, modulo 1.
std::map<int, int> foldsOf(const Places& places) {
  constexpr double kFolds = 4.0;
  std::map<int, int> fold_of_node;
  for (const int node : places.node) {
    const double turns = std::numbers::phi * static_cast<double>(fold_of_node.size());
    fold_of_node.emplace(node, static_cast<int>(kFolds * (turns - std::floor(turns))));
  }
  return fold_of_node;
}

Result<identify::PhysicsFit> findScene(const FitData& data, const Places& places, const Settings& settings,
                                       const RunControl& control) {
  identify::PhysicsFit none;
  none.why_none = "the tracker's transmitter is no dipole, and another's physics is not known";
  if (!data.is_dipole) return none;
  none.why_none = "the places span no plane";
  if (data.dimension < 2 || pointSpread(data.p_tracked_m).dimension < 2) return none;
  const auto most_places = static_cast<std::size_t>(integerSetting(settings, kSearchPlaces));
  const std::vector<std::size_t> rows = searchedRows(places, most_places);
  identify::PhysicsFitOptions options;
  options.most_effects = static_cast<int>(std::clamp<std::int64_t>(
      static_cast<std::int64_t>(places.size()) / kPlacesPerEffect, 1, integerSetting(settings, kMostEffects)));
  options.fold_of_node = foldsOf(places);
  RunControl part = control;
  part.progress = [&](double fraction) { control.progress(0.7 * fraction); };
  for (const std::size_t row : rows) options.searched_nodes.insert(data.node[row]);
  auto fit = identify::fitPhysics(tableOf(data), options, part);
  if (!fit || !fit->positions) return fit;
  if (!helpsHeldOut(rowsOfFitData(data, rows), fit->without_fold, options.fold_of_node, settings)) {
    fit->positions.reset();
    fit->why_none = "the one that fits best (" + listed(fit->named) + ") does not foretell places left out 5 % better";
  }
  return fit;
}

std::string noteOf(const identify::PhysicsFit& fit) {
  std::string note = fit.positions ? "Scene: " + listed(fit.named) + "; a Gaussian process on what remains."
                                   : "No scene, since " + fit.why_none + ": a Gaussian process alone.";
  if (!fit.left_out.empty()) note += " Left to the Gaussian process: " + listed(fit.left_out) + ".";
  return note;
}

Result<std::unique_ptr<PositionModel>> fitPhysicsResidual(const FitData& data, const Settings& settings,
                                                          const RunControl& control) {
  FT_TRY(const auto places, smoothFitPlaces(data, kName));
  FT_TRY(auto fit, findScene(data, places, settings, control));
  if (fit.positions && !undone(data, *fit.positions)) {
    fit.positions.reset();
    fit.why_none = kNoPlace;
  }
  const std::string note = noteOf(fit);
  return modelOf(data, std::move(fit.positions), note, settings, control);
}

identify::ScenePositions sceneFrom(const JsonReader& json) {
  identify::PositionScene scene;
  scene.tracker_from_reference = json["tracker_from_reference"].pose();
  scene.tracker_from_sensor = json["tracker_from_sensor_q_wxyz"].quaternion();
  for (const JsonReader& effect : json["effects"].entries())
    scene.effects.push_back({effect["id"].text(), effect["parameters"].raw()});
  const Eigen::MatrixXd places_m = json["places_m"].matrix(3);
  for (Eigen::Index i = 0; i < places_m.rows(); ++i) scene.places_m.emplace_back(places_m.row(i).transpose());
  return json.valueOf(identify::ScenePositions::make(std::move(scene)));
}

}  // namespace

std::unique_ptr<PositionModel> readPhysicsResidualPosition(const JsonReader& parameters) {
  std::optional<identify::ScenePositions> physics;
  if (const JsonReader scene = parameters["scene"]; !scene.isNull()) physics = sceneFrom(scene);
  return std::make_unique<PhysicsResidual>(std::move(physics), readGaussianProcessPosition(parameters["remainder"]),
                                           parameters["note"].text());
}

/// The scene that a diagnosis finds behind the data, undone by inverting what a tracker reports in it, and a Gaussian
/// process on what remains; where no effect is found, the Gaussian process alone.
PositionMethod physicsResidualPosition() {
  PositionMethod method;
  method.id = "physics_residual";
  method.label = "Physics, then Gaussian process";
  method.source =
      "Model plus discrepancy: Kennedy and O'Hagan 2001, J. R. Statist. Soc. B 63 425, eq. 4; effects and Gaussian "
      "process as they stand in this program";
  method.settings = gaussianProcessPosition().settings;
  method.settings.push_back(declare::integer(
      kMostEffects, "Most effects", {1, 4}, 2,
      "No more effects than this are sought behind the data, and no more than one for every 60 places."));
  method.settings.push_back(
      declare::integer(kSearchPlaces, "Places for the scene", {50, 3000}, 80,
                       "With more places than these, the scene is sought on a well-spread part of them; "
                       "all refine it, and the Gaussian process takes all."));
  method.fit = fitPhysicsResidual;
  method.read = readPhysicsResidualPosition;
  method.cost = FitCost::kVeryCostly;
  method.tuning = Tuning::kAlways;
  method.origin = MethodOrigin::kLater;
  return method;
}

}  // namespace fieldtrue::correctors
