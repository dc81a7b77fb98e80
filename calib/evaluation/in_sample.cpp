#include "calib/evaluation/in_sample.h"

#include <algorithm>
#include <chrono>

#include "calib/calibration/alignment.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/held_out_job.h"
#include "calib/evaluation/place_scores.h"

namespace fieldtrue::evaluation {
namespace {

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Mean time of one evaluation over the nodes, repeated until the clock can tell [ns].
double evaluationTime_ns(const FittedCandidate& fitted, std::span<const Node> nodes) {
  constexpr double kLongEnough_s = 5e-4;
  const auto start = std::chrono::steady_clock::now();
  double n_evaluations = 0.0;
  double elapsed_s = 0.0;
  while (elapsed_s < kLongEnough_s)
    for (std::size_t first = 0; first < nodes.size() && elapsed_s < kLongEnough_s; first += 64) {
      const auto some = nodes.subspan(first, std::min<std::size_t>(64, nodes.size() - first));
      for (const Node& node : some) fitted.evaluate(node);
      n_evaluations += static_cast<double>(some.size());
      elapsed_s = secondsSince(start);
    }
  return 1e9 * elapsed_s / n_evaluations;
}

std::string noOrientationText(const HeldOutJob& job) {
  const auto n_without =
      std::count_if(job.nodes.begin(), job.nodes.end(), [](const Node& node) { return !node.has_orientation; });
  return std::to_string(n_without) + " of " + std::to_string(job.nodes.size()) + " rows have no orientation";
}

}  // namespace

CandidateScores fitInSample(const HeldOutJob& job, const Candidate& candidate, const correctors::FitData& data,
                            const calibration::Alignment& alignment, const RunControl& control) {
  CandidateScores scores;
  if (!candidate.is_position && !job.has_orientation) {
    scores.skipped = noOrientationText(job);
    return scores;
  }
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Node> fitted = rowsOf(job, job.fitted);
  const auto model = job.separate_sensors
                         ? fitSensorsApart(candidate, fitted, job.metadata, alignment, data.dimension, control)
                         : candidate.fit(data, control);
  if (!model) {
    scores.skipped = model.error().message;
    return scores;
  }
  scores.fit_s = secondsSince(start);
  scores.eval_ns = evaluationTime_ns(*model, fitted);
  scores.in_sample_rms =
      rootMeanSquare(gatherByPlace(placesOf(fitted), fitted, scoreRows(fitted, alignment, model->score)).errors);
  if (!model->note.empty()) scores.notes.push_back(model->note);
  if (job.validation.kind == ValidationKind::kRole) {
    scores.held_out = scoreRows(rowsOf(job, job.scored), alignment, model->score);
    scores.n_folds = 1;
  } else {
    scores.coefficients_a_place = model->coefficients / static_cast<double>(correctors::mergePlaces(data).size());
  }
  return scores;
}

}  // namespace fieldtrue::evaluation
