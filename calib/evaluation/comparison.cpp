#include "calib/evaluation/comparison.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>

#include "calib/evaluation/candidate.h"
#include "calib/evaluation/folds.h"
#include "calib/evaluation/noise_floor.h"
#include "calib/evaluation/resampling.h"
#include "calib/evaluation/verdict.h"

namespace fieldtrue {
namespace {

/// Everything the steps of one comparison share; fixed before the folds run.
struct Job {
  std::vector<Node> nodes;  ///< Rows that count.
  TableMetadata metadata;
  std::vector<Fold> folds;
  std::vector<std::size_t> all_fitted;  ///< Rows of the in-sample fit.
  std::vector<Candidate> candidates;
  AlignMode align = AlignMode::kRigid;
  bool has_orientation = false;
  int dimension = 3;  ///< Of the true positions of all fitted rows.
};

/// Scores of the rows of one fold, in the fold's order.
struct FoldResult {
  std::vector<RowScore> before_position;
  std::vector<RowScore> before_orientation;
  std::vector<std::vector<RowScore>> candidates;  ///< Empty for a candidate that could not be fitted.
  std::vector<std::optional<std::string>> why_not;
  std::optional<Error> error;  ///< Of the alignment, or that it was stopped.
};

std::vector<Node> rowsOf(const Job& job, const std::vector<std::size_t>& rows) {
  std::vector<Node> nodes;
  nodes.reserve(rows.size());
  for (const std::size_t row : rows) nodes.push_back(job.nodes[row]);
  return nodes;
}

Result<Alignment> alignmentOf(const Job& job, std::span<const Node> nodes) {
  return job.align == AlignMode::kRigid ? fitAlignment(nodes) : Result<Alignment>(Alignment{});
}

std::vector<RowScore> scoreRows(std::span<const Node> nodes, const Alignment& alignment,
                                const std::function<RowScore(const Node&, const Alignment&)>& score) {
  std::vector<RowScore> scores;
  scores.reserve(nodes.size());
  for (const Node& node : nodes) scores.push_back(score(node, alignment));
  return scores;
}

std::string noOrientationText(const Job& job) {
  const auto n_without =
      std::count_if(job.nodes.begin(), job.nodes.end(), [](const Node& node) { return !node.has_orientation; });
  return std::to_string(n_without) + " of " + std::to_string(job.nodes.size()) + " rows have no orientation";
}

FoldResult runFold(const Job& job, const Fold& fold, const std::vector<MethodScore>& in_sample,
                   const RunControl& control) {
  FoldResult result;
  result.candidates.resize(job.candidates.size());
  result.why_not.resize(job.candidates.size());
  const std::vector<Node> fitted = rowsOf(job, fold.fitted);
  const std::vector<Node> scored = rowsOf(job, fold.scored);
  const auto alignment = alignmentOf(job, fitted);
  if (!alignment) {
    result.error = alignment.error();
    return result;
  }
  result.before_position = scoreRows(scored, *alignment, alignedPositionScore);
  if (job.has_orientation) result.before_orientation = scoreRows(scored, *alignment, alignedOrientationScore);
  FitData data = makeFitData(fitted, job.metadata, *alignment);
  // Places that span a volume are not fitted in a plane only because the few of this fold lie in one.
  if (data.dimension == 2) data.dimension = job.dimension;
  for (std::size_t i = 0; i < job.candidates.size(); ++i) {
    if (control.stop.stop_requested()) {
      result.error = Error{ErrorCode::kCancelled, "The comparison was stopped on request"};
      return result;
    }
    if (in_sample[i].skipped) continue;
    const auto model = job.candidates[i].fit(data, control);
    if (model)
      result.candidates[i] = scoreRows(scored, *alignment, model->score);
    else
      result.why_not[i] = model.error().message + " (with place " + std::to_string(scored.front().node) + " held out)";
  }
  return result;
}

/// Scores and coverage of rows, gathered by place.
struct PlaceScores {
  std::vector<double> errors;
  std::vector<Eigen::Vector3d> residual_m;
  std::vector<bool> covered;
};

/// @param places node numbers, in the order wanted
/// @param rows node number and score of each row
PlaceScores gatherByPlace(const std::vector<int>& places, const std::vector<std::pair<int, RowScore>>& rows) {
  std::map<int, std::size_t> slot;
  for (std::size_t i = 0; i < places.size(); ++i) slot[places[i]] = i;
  PlaceScores gathered{std::vector<double>(places.size(), 0.0),
                       std::vector<Eigen::Vector3d>(places.size(), Eigen::Vector3d::Zero()),
                       std::vector<bool>(places.size(), true)};
  std::vector<double> n_rows(places.size(), 0.0);
  for (const auto& [place, score] : rows) {
    const std::size_t i = slot.at(place);
    n_rows[i] += 1.0;
    gathered.errors[i] += score.error * score.error;
    gathered.residual_m[i] += score.residual_m;
    gathered.covered[i] = gathered.covered[i] && score.covered;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    gathered.errors[i] = std::sqrt(gathered.errors[i] / n_rows[i]);
    gathered.residual_m[i] /= n_rows[i];
  }
  return gathered;
}

std::vector<std::pair<int, RowScore>> withPlaces(std::span<const Node> nodes, const std::vector<RowScore>& scores) {
  std::vector<std::pair<int, RowScore>> rows;
  for (std::size_t i = 0; i < nodes.size(); ++i) rows.emplace_back(nodes[i].node, scores[i]);
  return rows;
}

template <class Scores>
PlaceScores gatherFolds(const Job& job, const std::vector<int>& places, const std::vector<FoldResult>& results,
                        Scores scores_of) {
  std::vector<std::pair<int, RowScore>> rows;
  for (std::size_t k = 0; k < results.size(); ++k) {
    const std::vector<RowScore>& scores = scores_of(results[k]);
    for (std::size_t i = 0; i < scores.size(); ++i)
      rows.emplace_back(job.nodes[job.folds[k].scored[i]].node, scores[i]);
  }
  return gatherByPlace(places, rows);
}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Mean time of one evaluation over the nodes, repeated until the clock can tell [ns].
double evaluationTime_ns(const FittedCandidate& fitted, std::span<const Node> nodes) {
  constexpr double kLongEnough_s = 5e-4;
  const auto start = std::chrono::steady_clock::now();
  double n_evaluations = 0.0;
  double elapsed_s = 0.0;
  while (elapsed_s < kLongEnough_s) {
    for (const Node& node : nodes) fitted.evaluate(node);
    n_evaluations += static_cast<double>(nodes.size());
    elapsed_s = secondsSince(start);
  }
  return 1e9 * elapsed_s / n_evaluations;
}

/// Fits every candidate once on all rows it may see: whether it can be used, how long it takes, how well it fits.
/// @param job its dimension is set here
Result<std::vector<MethodScore>> fitInSample(Job& job, Comparison& comparison, const RunControl& control) {
  const std::vector<Node> fitted = rowsOf(job, job.all_fitted);
  const auto alignment = alignmentOf(job, fitted);
  if (!alignment) return tl::unexpected(alignment.error());
  const FitData data = makeFitData(fitted, job.metadata, *alignment);
  job.dimension = data.dimension;
  if (data.dimension == 2)
    comparison.notes.push_back("The places lie in one plane: methods are fitted in it, and nothing is claimed off it.");
  const std::vector<int> places = placesOf(fitted);
  std::vector<MethodScore> scores;
  for (const Candidate& candidate : job.candidates) {
    MethodScore& score = scores.emplace_back();
    score.method = candidate.id;
    score.settings = candidate.settings;
    if (!candidate.is_position && !job.has_orientation) {
      score.skipped = noOrientationText(job);
      continue;
    }
    const auto start = std::chrono::steady_clock::now();
    const auto model = candidate.fit(data, control);
    if (!model && model.error().code == ErrorCode::kCancelled) return tl::unexpected(model.error());
    if (!model) {
      score.skipped = model.error().message;
      continue;
    }
    score.fit_s = secondsSince(start);
    score.eval_ns = evaluationTime_ns(*model, fitted);
    score.in_sample_rms =
        rootMeanSquare(gatherByPlace(places, withPlaces(fitted, scoreRows(fitted, *alignment, model->score))).errors);
    if (!model->note.empty()) score.notes.push_back(model->note);
  }
  return scores;
}

Result<std::vector<FoldResult>> runFolds(const Job& job, const std::vector<MethodScore>& in_sample,
                                         const RunControl& control) {
  std::vector<FoldResult> results(job.folds.size());
  std::atomic<std::size_t> n_done{0};
  control.parallel_for(job.folds.size(), [&](std::size_t k) {
    if (control.stop.stop_requested())
      results[k].error = Error{ErrorCode::kCancelled, "The comparison was stopped on request"};
    else
      results[k] = runFold(job, job.folds[k], in_sample, control);
    control.progress(static_cast<double>(++n_done) / static_cast<double>(job.folds.size()));
  });
  for (const FoldResult& result : results)
    if (result.error) return tl::unexpected(*result.error);
  return results;
}

/// What a method would leave undone, for a score that was begun but cannot be finished.
void skip(MethodScore& score, std::string why) {
  MethodScore skipped;
  skipped.method = std::move(score.method);
  skipped.settings = std::move(score.settings);
  skipped.skipped = std::move(why);
  score = std::move(skipped);
}

void scoreHeldOut(const Job& job, const std::vector<FoldResult>& results, std::vector<MethodScore>& scores,
                  Comparison& comparison, std::uint64_t seed) {
  std::vector<bool> covered_by_all(comparison.places.size(), true);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    MethodScore& score = scores[i];
    for (const FoldResult& result : results)
      if (result.why_not[i] && !score.skipped) skip(score, *result.why_not[i]);
    if (score.skipped) continue;
    PlaceScores held_out = gatherFolds(
        job, comparison.places, results, [i](const FoldResult& result) -> const auto& { return result.candidates[i]; });
    score.stats = errorStats(held_out.errors, seed);
    score.n_uncovered = static_cast<int>(std::count(held_out.covered.begin(), held_out.covered.end(), false));
    score.place_errors = std::move(held_out.errors);
    if (!job.candidates[i].is_position) continue;
    score.residual_m = std::move(held_out.residual_m);
    for (std::size_t k = 0; k < covered_by_all.size(); ++k)
      covered_by_all[k] = covered_by_all[k] && held_out.covered[k];
  }
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (!scores[i].skipped && job.candidates[i].is_position) {
      std::vector<double> common;
      for (std::size_t k = 0; k < covered_by_all.size(); ++k)
        if (covered_by_all[k]) common.push_back(scores[i].place_errors[k]);
      scores[i].rms_common_mm = rootMeanSquare(common);
    }
    (job.candidates[i].is_position ? comparison.position : comparison.orientation).push_back(std::move(scores[i]));
  }
}

void scoreBefore(const Job& job, const std::vector<FoldResult>& results, Comparison& comparison, std::uint64_t seed) {
  PlaceScores position = gatherFolds(
      job, comparison.places, results, [](const FoldResult& result) -> const auto& { return result.before_position; });
  comparison.before_position_mm = errorStats(position.errors, seed);
  comparison.before_place_mm = std::move(position.errors);
  comparison.before_residual_m = std::move(position.residual_m);
  if (!job.has_orientation) return;
  PlaceScores orientation = gatherFolds(
      job, comparison.places, results,
      [](const FoldResult& result) -> const auto& { return result.before_orientation; });
  comparison.before_orientation_deg = errorStats(orientation.errors, seed);
  comparison.before_place_deg = std::move(orientation.errors);
}

Result<Job> prepare(const CalibrationTable& table, const ComparisonOptions& options, Comparison& comparison) {
  Job job;
  job.metadata = table.metadata;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(job.nodes),
               [](const Node& node) { return node.role != NodeRole::kSkipped; });
  if (job.nodes.empty())
    return fail(ErrorCode::kTooFewNodes, table.nodes.empty()
                                             ? "The table has no rows to compare methods on"
                                             : "Every row of the table is skipped; nothing is left to compare");
  auto position = positionCandidates(options.position_methods);
  if (!position) return tl::unexpected(position.error());
  auto orientation = orientationCandidates(options.orientation_methods);
  if (!orientation) return tl::unexpected(orientation.error());
  job.candidates = *std::move(position);
  std::move(orientation->begin(), orientation->end(), std::back_inserter(job.candidates));
  comparison.validation = options.validation.value_or(defaultValidation(table));
  comparison.align = job.align = options.align.value_or(defaultAlignMode(table.metadata));
  job.has_orientation =
      std::all_of(job.nodes.begin(), job.nodes.end(), [](const Node& node) { return node.has_orientation; });
  auto folds = makeFolds(job.nodes, comparison.validation, options.seed);
  if (!folds) return tl::unexpected(folds.error());
  job.folds = *std::move(folds);
  job.all_fitted = job.folds.front().fitted;
  if (comparison.validation.kind != ValidationKind::kRole) {
    job.all_fitted.resize(job.nodes.size());
    for (std::size_t row = 0; row < job.nodes.size(); ++row) job.all_fitted[row] = row;
  }
  return job;
}

}  // namespace

Result<Comparison> compareMethods(const CalibrationTable& table, const ComparisonOptions& options,
                                  const RunControl& control) {
  Comparison comparison;
  auto job = prepare(table, options, comparison);
  if (!job) return tl::unexpected(job.error());
  auto scores = fitInSample(*job, comparison, control);
  if (!scores) return tl::unexpected(scores.error());
  const auto results = runFolds(*job, *scores, control);
  if (!results) return tl::unexpected(results.error());

  std::vector<bool> is_scored(job->nodes.size(), false);
  for (const Fold& fold : job->folds)
    for (const std::size_t row : fold.scored) is_scored[row] = true;
  std::vector<Node> scored;
  for (std::size_t row = 0; row < is_scored.size(); ++row)
    if (is_scored[row]) scored.push_back(job->nodes[row]);
  comparison.places = placesOf(scored);
  comparison.n_places = static_cast<int>(placesOf(job->nodes).size());
  comparison.validation_places = static_cast<int>(comparison.places.size());
  const NoiseFloor floor = noiseFloor(scored, job->metadata);
  comparison.floor_position_mm = floor.position_mm;
  comparison.floor_orientation_deg = floor.orientation_deg;
  comparison.floor_from = floor.from;

  scoreBefore(*job, *results, comparison, options.seed);
  scoreHeldOut(*job, *results, *scores, comparison, options.seed);
  judge(comparison, options.seed);
  return comparison;
}

}  // namespace fieldtrue
