#include "calib/evaluation/comparison.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/calibration/coincident_places.h"
#include "calib/correctors/method_label.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/base/noise_floor.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/error_stats.h"
#include "calib/evaluation/held_out.h"
#include "calib/evaluation/held_out_job.h"
#include "calib/evaluation/limits.h"
#include "calib/evaluation/place_scores.h"
#include "calib/evaluation/sensor_scores.h"
#include "calib/evaluation/sensor_splits.h"
#include "calib/evaluation/surroundings.h"
#include "calib/evaluation/verdict.h"
#include "calib/tables/true_box.h"

namespace fieldtrue::evaluation {
namespace {

/// Statistics over the places at the edge, or over the others; none where there are none.
std::optional<ErrorStats> statsWhere(const std::vector<double>& errors, const std::vector<bool>& is_edge, bool wanted,
                                     const FitFreedom& freedom) {
  std::vector<double> some;
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (is_edge[i] == wanted) some.push_back(errors[i]);
  return some.empty() ? std::nullopt : std::optional(errorStats(some, freedom));
}

/// The places' errors of one candidate, with what its fits told.
MethodScore methodScore(const Candidate& candidate, CandidateScores scores, const std::vector<Node>& scored,
                        const Comparison& comparison) {
  MethodScore score;
  score.method = candidate.id;
  score.settings = candidate.settings;
  score.skipped = std::move(scores.skipped);
  if (score.skipped) return score;
  score.freedom = {.coefficients_a_place = scores.coefficients_a_place,
                   .is_tuned = candidate.is_tuned,
                   .own_variance = scores.own_variance};
  score.sensors = scoresBySensor(scored, scores.held_out, score.freedom);
  score.freedom.positions_a_place = comparison.positions_a_place;
  PlaceScores held_out = gatherByPlace(comparison.places, scored, scores.held_out);
  score.stats = errorStats(held_out.errors, score.freedom);
  score.inside = statsWhere(held_out.errors, comparison.is_edge, false, score.freedom);
  score.edge = statsWhere(held_out.errors, comparison.is_edge, true, score.freedom);
  score.n_uncovered = static_cast<int>(std::count(held_out.covered.begin(), held_out.covered.end(), false));
  score.place_errors = std::move(held_out.errors);
  score.place_covered = std::move(held_out.covered);
  if (candidate.is_position) score.residual_m = std::move(held_out.residual_m);
  score.validated = scores.validated;
  score.tuned_inside = scores.tuned_inside;
  score.n_folds = scores.n_folds;
  score.closed_form = scores.closed_form;
  score.in_sample_rms = scores.in_sample_rms;
  score.fit_s = scores.fit_s;
  score.eval_ns = scores.eval_ns;
  score.notes = std::move(scores.notes);
  return score;
}

void scoreCommonPlaces(std::vector<MethodScore>& scores, std::size_t n_places) {
  std::vector<bool> covered_by_all(n_places, true);
  for (const MethodScore& score : scores)
    for (std::size_t k = 0; k < n_places && !score.skipped; ++k)
      covered_by_all[k] = covered_by_all[k] && score.place_covered[k];
  for (MethodScore& score : scores) {
    if (score.skipped) continue;
    std::vector<double> common;
    for (std::size_t k = 0; k < n_places; ++k)
      if (covered_by_all[k]) common.push_back(score.place_errors[k]);
    score.rms_common_mm = common.empty() ? std::nan("") : rootMeanSquare(common);
  }
}

void scoreMethods(const HeldOutJob& job, HeldOutScores& held_out, const std::vector<Node>& scored,
                  Comparison& comparison, const RunControl& control) {
  std::vector<MethodScore> scores(job.candidates.size());
  control.parallel_for(scores.size(), [&](std::size_t i) {
    if (control.stop.stop_requested()) return;
    scores[i] = methodScore(job.candidates[i], std::move(held_out.candidates[i]), scored, comparison);
  });
  for (std::size_t i = 0; i < scores.size(); ++i)
    (job.candidates[i].is_position ? comparison.position : comparison.orientation).push_back(std::move(scores[i]));
}

void scoreBefore(const HeldOutJob& job, const HeldOutScores& held_out, const std::vector<Node>& scored,
                 Comparison& comparison) {
  comparison.before_sensors = scoresBySensor(scored, held_out.before_position, {});
  PlaceScores position = gatherByPlace(comparison.places, scored, held_out.before_position);
  const FitFreedom freedom{.positions_a_place = comparison.positions_a_place};
  comparison.before_position_mm = errorStats(position.errors, freedom);
  comparison.before_place_mm = std::move(position.errors);
  comparison.before_residual_m = std::move(position.residual_m);
  if (!job.has_orientation) return;
  PlaceScores orientation = gatherByPlace(comparison.places, scored, held_out.before_orientation);
  comparison.before_orientation_deg = errorStats(orientation.errors, freedom);
  comparison.before_place_deg = std::move(orientation.errors);
}

/// Volume of the box around some rows' true positions, of that around all of them; axes along which all lie together
/// do not count.
double shareOfBox(const std::vector<Node>& some, const std::vector<Node>& all) {
  const Eigen::Vector3d whole_m = trueBox_m(all).sizes(), part_m = trueBox_m(some).sizes();
  double share = 1.0;
  for (int axis = 0; axis < 3; ++axis)
    if (whole_m[axis] > 1e-3 * whole_m.maxCoeff()) share *= part_m[axis] / whole_m[axis];
  return share;
}

/// What the job itself tells, before anything is scored.
Comparison begin(const HeldOutJob& job, const std::vector<Node>& scored) {
  Comparison comparison;
  comparison.validation = job.validation;
  comparison.align = job.align;
  comparison.places = placesOf(scored);
  comparison.positions_a_place = calibration::positionsAPlace(scored);
  comparison.is_edge = outermostPlaces(rowsOf(job, job.fitted), job.nodes, comparison.places);
  comparison.names = PlaceNames(job.nodes);
  comparison.n_places = static_cast<int>(placesOf(job.nodes).size());
  comparison.validation_places = static_cast<int>(comparison.places.size());
  comparison.validated_share = shareOfBox(scored, job.nodes);
  comparison.notes = job.notes;
  const NoiseFloor floor = noiseFloor(scored, job.metadata);
  comparison.floor_position_mm = floor.position_mm;
  comparison.floor_orientation_deg = floor.orientation_deg;
  comparison.floor_from = floor.from;
  return comparison;
}

/// Which methods were held out from one fit, and what that means for what their fits choose.
void noteClosedForm(Comparison& comparison) {
  std::vector<std::string> labels;
  for (const MethodScore& score : comparison.position)
    if (score.closed_form) labels.push_back(correctors::positionLabel(score.method));
  for (const MethodScore& score : comparison.orientation)
    if (score.closed_form) labels.push_back(correctors::orientationLabel(score.method));
  std::string names;
  std::set<std::string> named;
  for (const std::string& label : labels)
    if (named.insert(label).second) names += (names.empty() ? "" : ", ") + label;
  if (!names.empty()) comparison.notes.push_back("Held out in closed form, from one fit to all places: " + names + ".");
}

/// Methods whose figures are not those of the others: told, and never called best.
void noteUnranked(Comparison& comparison) {
  std::string names;
  const auto add = [&](const std::vector<MethodScore>& scores, auto label) {
    for (const MethodScore& score : scores)
      if (!score.skipped && !isRanked(score, comparison))
        names += (names.empty() ? "" : ", ") + label(score.method, score.settings);
  };
  add(comparison.position,
      [](const std::string& id, const Settings& settings) { return correctors::positionLabel(id, settings); });
  add(comparison.orientation,
      [](const std::string& id, const Settings& settings) { return correctors::orientationLabel(id, settings); });
  if (!names.empty())
    comparison.notes.push_back(
        "Not ranked, because what they choose saw the places held out, or because they were "
        "held out otherwise than the others: " +
        names + ". Compared with kfold:10, all are.");
}

}  // namespace

Result<Comparison> compareMethods(const CalibrationTable& table, const ComparisonOptions& options,
                                  const RunControl& control) {
  FT_TRY(const auto job, makeJob(table, options));
  const double scores_end = options.with_surroundings ? 0.9 : 1.0;
  constexpr double surroundings_end = 0.95;
  FT_TRY(auto held_out, scoreHeldOut(job, partOf(control, 0.0, scores_end)));

  const std::vector<Node> scored = rowsOf(job, job.scored);
  Comparison comparison = begin(job, scored);
  if (held_out.dimension == 2)
    comparison.notes.push_back("The places lie in one plane: methods are fitted in it, and nothing is claimed off it.");
  scoreBefore(job, held_out, scored, comparison);
  scoreMethods(job, held_out, scored, comparison, control);
  if (control.stop.stop_requested()) return comparisonStopped();
  scoreCommonPlaces(comparison.position, comparison.places.size());
  noteClosedForm(comparison);
  noteUnranked(comparison);
  pickBest(comparison);
  judgePlaces(comparison);
  if (control.stop.stop_requested()) return comparisonStopped();
  if (options.with_surroundings)
    FT_TRY_VOID(addSurroundings(comparison, table, job, partOf(control, scores_end, surroundings_end)));
  if (options.with_surroundings) {
    FT_TRY_VOID(addSplits(comparison, table, options, partOf(control, surroundings_end, 1.0)));
    control.progress(1.0);
  }
  // Whichever correction the sensors get, it stands on the same places.
  if (comparison.verdict.is_folding) comparison.verdict.apply_position = comparison.verdict.position.apply = false;
  noteFloors(comparison);
  writeVerdictText(comparison);
  return comparison;
}

}  // namespace fieldtrue::evaluation
