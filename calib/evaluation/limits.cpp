#include "calib/evaluation/limits.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/held_out_job.h"
#include "calib/evaluation/place_scores.h"
#include "calib/evaluation/region/region_lattice.h"
#include "calib/evaluation/verdict.h"
#include "calib/geometry/convex_hull.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::evaluation {
namespace {

/// An error up to this much above the floor is explained by it.
constexpr double kNearFloor = 1.25;
/// One group of places errs more than the rest when its RMS is this much larger.
constexpr double kMuchLarger = 1.5;
/// Fits on half of the places this much worse mean that more places would help.
constexpr double kHelps = 1.25;
/// A place whose removal takes this share off the RMS stands for it alone.
constexpr double kAlone = 0.25;

std::vector<Eigen::Vector3d> truePositions(std::span<const Node> nodes) {
  std::vector<Eigen::Vector3d> p_m;
  std::map<int, bool> seen;
  for (const Node& node : nodes)
    if (seen.try_emplace(node.node, true).second) p_m.push_back(node.reference_from_sensor.position_m);
  return p_m;
}

/// How far outside the places' hull a point is, in their plane; negative inside.
std::function<double(const Eigen::Vector3d&)> outsideInPlane(std::span<const Eigen::Vector3d> p_m) {
  const PointSpread spread = pointSpread(p_m);
  std::vector<Eigen::Vector2d> flat_m;
  for (const Eigen::Vector3d& point_m : p_m)
    flat_m.emplace_back(spread.axes.leftCols<2>().transpose() * (point_m - spread.center_m));
  return [spread, corners_m = convexPolygon(flat_m)](const Eigen::Vector3d& point_m) {
    const Eigen::Vector2d flat = spread.axes.leftCols<2>().transpose() * (point_m - spread.center_m);
    double outside_m = -HUGE_VAL;
    for (std::size_t i = 0; i < corners_m.size(); ++i) {
      const Eigen::Vector2d edge_m = corners_m[(i + 1) % corners_m.size()] - corners_m[i];
      const Eigen::Vector2d outward = Eigen::Vector2d(edge_m.y(), -edge_m.x()).normalized();
      outside_m = std::max(outside_m, outward.dot(flat - corners_m[i]));
    }
    return outside_m;
  };
}

std::function<double(const Eigen::Vector3d&)> outsideOf(std::span<const Eigen::Vector3d> p_m) {
  const int dimension = pointSpread(p_m).dimension;
  if (dimension == 2) return outsideInPlane(p_m);
  return [region = Region::around(p_m, dimension, 0.0)](const Eigen::Vector3d& point_m) {
    return region.outside_m(point_m);
  };
}

std::map<int, Eigen::Vector3d> positionOfPlace(std::span<const Node> nodes) {
  std::map<int, Eigen::Vector3d> p_m;
  for (const Node& node : nodes) p_m.try_emplace(node.node, node.reference_from_sensor.position_m);
  return p_m;
}

/// RMS over the places picked, and over the others; none where there are none.
struct Split {
  std::optional<double> picked;
  std::optional<double> others;
  bool pickedIsMuchLarger() const { return picked && others && *picked > kMuchLarger * *others; }
};

Split splitRms(const std::vector<double>& errors, const std::vector<bool>& is_picked) {
  std::vector<double> parts[2];
  for (std::size_t i = 0; i < errors.size(); ++i) parts[is_picked[i] ? 1 : 0].push_back(errors[i]);
  const auto rms = [](const std::vector<double>& part) {
    return part.empty() ? std::nullopt : std::optional(rootMeanSquare(part));
  };
  return {rms(parts[1]), rms(parts[0])};
}

const MethodScore* bestScore(const Comparison& comparison) {
  return comparison.best_position_row ? &comparison.position[*comparison.best_position_row] : nullptr;
}

/// Errors of what the verdict recommends.
const std::vector<double>& recommendedErrors(const Comparison& comparison) {
  const MethodScore* best = bestScore(comparison);
  if (best == nullptr || !comparison.verdict.apply_position) return comparison.before_place_mm;
  return isApart(comparison.split) ? comparison.split->after : best->place_errors;
}

std::vector<bool> nearHoles(const Comparison& comparison, const HeldOutJob& job) {
  const std::map<int, Eigen::Vector3d> p_m = positionOfPlace(job.nodes);
  std::vector<bool> is_near;
  for (const int place : comparison.places)
    is_near.push_back(
        std::any_of(comparison.coverage->holes.begin(), comparison.coverage->holes.end(),
                    [&](const Hole& hole) { return (p_m.at(place) - hole.center_m).norm() < 1.2 * hole.radius_m; }));
  return is_near;
}

std::vector<bool> inFoldedCells(const Comparison& comparison) {
  std::set<int> folded;
  for (const FoldBackCell& cell : comparison.fold_back->cells)
    if (!cell.one_to_one) folded.insert(cell.nodes.begin(), cell.nodes.end());
  std::vector<bool> is_in;
  for (const int place : comparison.places) is_in.push_back(folded.contains(place));
  return is_in;
}

std::optional<std::string> onePlace(const Comparison& comparison, const std::vector<double>& errors, double rms_mm) {
  if (errors.size() < 4) return std::nullopt;
  std::vector<double> rest = errors;
  rest.erase(std::max_element(rest.begin(), rest.end()));
  const double without_mm = rootMeanSquare(rest);
  if (without_mm > (1.0 - kAlone) * rms_mm) return std::nullopt;
  return comparison.names.of(comparison.verdict.worst_node) + " alone (the others, fitted with it, " +
         errorText(without_mm) + " mm)";
}

/// What only some of the places show.
std::optional<std::string> somePlaces(const Comparison& comparison, const HeldOutJob& job,
                                      const std::vector<double>& errors) {
  if (comparison.fold_back && splitRms(errors, inFoldedCells(comparison)).pickedIsMuchLarger())
    return "the cells where the field folds back";
  if (comparison.coverage && splitRms(errors, nearHoles(comparison, job)).pickedIsMuchLarger())
    return "holes between the places";
  const Verdict& verdict = comparison.verdict;
  if (verdict.inside_mm && verdict.edge_mm && *verdict.edge_mm > kMuchLarger * *verdict.inside_mm)
    return "the edge of the region, where places stand on one side only";
  return std::nullopt;
}

}  // namespace

std::vector<bool> outermostPlaces(std::span<const Node> fitted, std::span<const Node> nodes,
                                  const std::vector<int>& places) {
  const std::vector<Eigen::Vector3d> p_fitted_m = truePositions(fitted);
  const auto outside_m = outsideOf(p_fitted_m);
  const double half_spacing_m = 0.5 * medianSpacing_m(p_fitted_m);
  const std::map<int, Eigen::Vector3d> p_m = positionOfPlace(nodes);
  std::vector<bool> is_outermost;
  for (const int place : places) is_outermost.push_back(outside_m(p_m.at(place)) > -half_spacing_m);
  return is_outermost;
}

void judgePlaces(Comparison& comparison) {
  const std::vector<double>& errors = recommendedErrors(comparison);
  if (errors.empty()) return;
  Verdict& verdict = comparison.verdict;
  const Split split = splitRms(errors, comparison.is_edge);
  verdict.edge_mm = split.picked;
  verdict.inside_mm = split.others;
  const auto worst = std::max_element(errors.begin(), errors.end());
  verdict.worst_node = comparison.places[static_cast<std::size_t>(worst - errors.begin())];
  verdict.worst_mm = *worst;
}

Result<std::optional<double>> rmsWithHalf_mm(const Comparison& comparison, const HeldOutJob& job,
                                             const RunControl& control) {
  if (!comparison.best_position_row) return std::optional<double>();
  HeldOutJob half = job;
  half.candidates = {job.candidates[*comparison.best_position_row]};
  if (half.candidates.front().is_costly) return std::optional<double>();
  half.candidates.front().hold_out = nullptr;
  half.validation = {ValidationKind::kFolds, 2};
  auto folds = makeFolds(rowsOf(job, job.fitted), half.validation, job.seed);
  if (!folds) return std::optional<double>();
  half.folds = *std::move(folds);
  if (job.validation.kind == ValidationKind::kRole) {
    half.folds.resize(1);
    for (std::size_t& row : half.folds.front().fitted) row = job.fitted[row];
    half.folds.front().scored = job.scored;
  }
  RunControl quiet = control;
  quiet.progress = [](double) {};
  const auto scores = scoreHeldOut(half, quiet);
  if (!scores && scores.error().code == ErrorCode::kCancelled) return tl::unexpected(scores.error());
  if (!scores || scores->candidates.front().skipped) return std::optional<double>();
  return std::optional(rootMeanSquare(
      gatherByPlace(comparison.places, rowsOf(job, half.scored), scores->candidates.front().held_out).errors));
}

std::string limitedBy(const Comparison& comparison, const HeldOutJob& job, std::optional<double> with_half_mm) {
  const std::vector<double>& errors = recommendedErrors(comparison);
  const double rms_mm = rootMeanSquare(errors);
  const double floor_mm = comparison.floor_position_mm;
  const bool is_floor_true = floor_mm <= kOverstatedFloor * rms_mm;
  if (floor_mm > 0.0 && is_floor_true && rms_mm <= kNearFloor * floor_mm)
    return "how exactly the places themselves are known (" + comparison.floor_from + ": " + errorText(floor_mm) +
           " mm)";
  if (auto one = onePlace(comparison, errors, rms_mm)) return *one;
  if (auto some = somePlaces(comparison, job, errors)) return *some;
  if (!comparison.verdict.apply_position && comparison.verdict.position.gain >= kNeededGain)
    return "a gain that these places do not show surely";
  if (!comparison.verdict.apply_position)
    return "error that no method predicts from the other places: the jig's or the noise's, or detail finer than the "
           "places are apart";
  const MethodScore& best = *bestScore(comparison);
  if (best.n_uncovered > 0 && best.rms_common_mm > 0.0 && rms_mm > kMuchLarger * best.rms_common_mm)
    return countText(static_cast<std::size_t>(best.n_uncovered), "place", "places") + " that the method does not reach";
  if (!with_half_mm)
    return "error of which it cannot be told whether more places would remove it: half of these are too few for the "
           "method, or too costly";
  if (*with_half_mm > kHelps * rms_mm)
    return "detail of the field between the places: fits on half of them err by " + errorText(*with_half_mm) +
           " mm, so more places would help";
  return "error that more places like these would hardly remove: the jig's or the noise's beyond what is stated, or "
         "the method's own";
}

}  // namespace fieldtrue::evaluation
