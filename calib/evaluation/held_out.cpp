#include "calib/evaluation/held_out.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/calibration/alignment.h"
#include "calib/core/place_name.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/held_out_job.h"
#include "calib/evaluation/in_sample.h"

namespace fieldtrue::evaluation {
namespace {

/// Shares of the whole that the stages take, for the progress told.
constexpr double kFitted = 0.15;
constexpr double kAligned = 0.2;

/// Folds of a method whose fit is costly, at most.
constexpr int kCostlyFolds = 10;

/// Where the scores of a row of HeldOutJob::nodes go: its place in HeldOutJob::scored.
std::vector<std::size_t> slotsOf(const HeldOutJob& job) {
  std::vector<std::size_t> slots(job.nodes.size(), 0);
  for (std::size_t i = 0; i < job.scored.size(); ++i) slots[job.scored[i]] = i;
  return slots;
}

/// Everything the tasks of one run share.
struct Run {
  const HeldOutJob& job;
  const RunControl& control;
  std::vector<std::size_t> slots;
  calibration::Alignment all_alignment;
  correctors::FitData all_data;
  std::vector<calibration::Alignment> fold_alignments;
  HeldOutScores& scores;
  std::vector<std::vector<std::optional<std::string>>> why_not;  ///< Of each candidate and fold.

  bool stopped() const { return control.stop.stop_requested(); }
  /// Fits inside a task neither tell their own progress nor start loops of their own.
  RunControl inner() const {
    RunControl quiet;
    quiet.stop = control.stop;
    return quiet;
  }
};

correctors::FitData foldData(const Run& run, const Fold& fold, const calibration::Alignment& alignment) {
  correctors::FitData data = calibration::makeFitData(rowsOf(run.job, fold.fitted), run.job.metadata, alignment);
  // Places that span a volume are not fitted in a plane only because the few of this fold lie in one.
  if (data.dimension == 2) data.dimension = run.scores.dimension;
  return data;
}

std::string heldOutText(const HeldOutJob& job, const Fold& fold) {
  std::size_t n_others = 0;
  const int first = job.nodes[fold.scored.front()].node;
  for (const int place : placesOf(rowsOf(job, fold.scored))) n_others += place != first;
  return " (with " + PlaceNames(job.nodes).of(first) +
         (n_others > 0 ? " and " + std::to_string(n_others) + " others" : std::string()) + " held out)";
}

void keepScores(const Run& run, std::size_t i, const Fold& fold, const calibration::Alignment& alignment,
                const FittedCandidate& model) {
  for (const std::size_t row : fold.scored)
    run.scores.candidates[i].held_out[run.slots[row]] = model.score(run.job.nodes[row], alignment);
}

/// One refit of one candidate.
void refit(Run& run, std::size_t i, std::size_t k, const Fold& fold, const correctors::FitData& data,
           const calibration::Alignment& alignment) {
  const Candidate& candidate = run.job.candidates[i];
  const auto model = run.job.separate_sensors
                         ? fitSensorsApart(candidate, rowsOf(run.job, fold.fitted), run.job.metadata, alignment,
                                           run.scores.dimension, run.inner())
                         : candidate.fit(data, run.inner());
  if (model)
    keepScores(run, i, fold, alignment, *model);
  else
    run.why_not[i][k] = model.error().message + heldOutText(run.job, fold);
}

/// Of a job that leaves places out, so that all of its rows may be fitted.
Result<FitsWithout> closedForm(const Run& run, const Candidate& candidate) {
  if (!run.job.separate_sensors) return candidate.hold_out(run.all_data, run.inner());
  return holdOutSensorsApart(candidate, run.job.nodes, run.job.metadata, run.all_alignment, run.scores.dimension,
                             run.inner());
}

/// Scores a candidate fold by fold from its closed form; where there is none for this data after all, by refitting.
void runClosedForm(Run& run, std::size_t i, ProgressMeter& meter, double share) {
  const auto fits = closedForm(run, run.job.candidates[i]);
  run.scores.candidates[i].closed_form = fits.has_value();
  if (fits) run.scores.candidates[i].own_variance = fits->own_variance;
  const Pose tracker_from_all = run.all_alignment.reference_from_tracker;
  for (std::size_t k = 0; k < run.job.folds.size() && !run.stopped(); ++k) {
    const Fold& fold = run.job.folds[k];
    const calibration::Alignment& alignment = run.fold_alignments[k];
    if (fits) {
      const auto model = fits->fit(leftOut(fold), inverse(alignment.reference_from_tracker) * tracker_from_all);
      if (model)
        keepScores(run, i, fold, alignment, *model);
      else
        run.why_not[i][k] = model.error().message + heldOutText(run.job, fold);
    } else {
      refit(run, i, k, fold, foldData(run, fold, alignment), alignment);
    }
    meter.add(share / static_cast<double>(run.job.folds.size()));
    if (run.why_not[i][k]) return;
  }
}

/// Whether the folds are taken off one fit. The closed form must be able to follow the alignment of each fold: it moves
/// the true positions, while an orientation's truth is turned by the mounting too. What a fit is tuned to stays as all
/// rows chose it, so only where refits would be as many as places is that accepted, and told.
bool hasClosedForm(const Run& run, const Candidate& candidate) {
  const HeldOutJob& job = run.job;
  if (!candidate.hold_out || !candidate.holds_out(run.all_data)) return false;
  if (candidate.is_tuned && job.validation.kind != ValidationKind::kLeaveOneOut) return false;
  return candidate.is_position || job.align == calibration::AlignMode::kNone;
}

bool isTooCostly(const HeldOutJob& job, const Candidate& candidate) {
  const bool may_regroup =
      job.validation.kind == ValidationKind::kLeaveOneOut || job.validation.kind == ValidationKind::kFolds;
  return may_regroup && candidate.is_costly && job.folds.size() > static_cast<std::size_t>(kCostlyFolds);
}

/// A part of the work that any thread may take.
struct Task {
  std::function<void()> work;
};

/// A costly candidate's own, larger folds, each a task.
Result<void> addCostly(Run& run, std::size_t i, ProgressMeter& meter, std::vector<Task>& tasks) {
  const Validation validation{ValidationKind::kFolds, kCostlyFolds};
  auto folds = makeFolds(run.job.nodes, validation, run.job.seed);
  if (!folds) return tl::unexpected(folds.error());
  CandidateScores& scores = run.scores.candidates[i];
  scores.n_folds = static_cast<int>(folds->size());
  scores.validated = validation;
  scores.notes.push_back("Scored with " + toText(validation) + " instead of " + toText(run.job.validation) +
                         ", because one fit is costly; its fits see fewer places than those of other methods.");
  for (std::size_t k = 0; k < folds->size(); ++k)
    tasks.push_back({[&run, i, k, &meter, fold = std::move((*folds)[k])] {
      const auto alignment = alignmentOf(run.job, rowsOf(run.job, fold.fitted));
      if (alignment)
        refit(run, i, k, fold, foldData(run, fold, *alignment), *alignment);
      else
        run.why_not[i][k] = alignment.error().message + heldOutText(run.job, fold);
      meter.add(run.scores.candidates[i].fit_s);
    }});
  return {};
}

/// Who is scored how; costly tasks first, so that no thread is left with one at the end.
Result<std::vector<Task>> makeTasks(Run& run, ProgressMeter& meter) {
  std::vector<Task> tasks;
  std::vector<std::size_t> closed;
  std::vector<std::size_t> plain;
  for (std::size_t i = 0; i < run.job.candidates.size(); ++i) {
    CandidateScores& scores = run.scores.candidates[i];
    if (scores.skipped) continue;
    const Candidate& candidate = run.job.candidates[i];
    scores.n_folds = static_cast<int>(run.job.folds.size());
    if (hasClosedForm(run, candidate)) {
      closed.push_back(i);
    } else if (isTooCostly(run.job, candidate)) {
      FT_TRY_VOID(addCostly(run, i, meter, tasks));
    } else {
      plain.push_back(i);
    }
  }
  for (const std::size_t i : closed)
    tasks.push_back({[&run, i, &meter] { runClosedForm(run, i, meter, 3.0 * run.scores.candidates[i].fit_s); }});
  for (std::size_t k = 0; k < run.job.folds.size() && !plain.empty(); ++k)
    tasks.push_back({[&run, k, plain, &meter] {
      const Fold& fold = run.job.folds[k];
      const correctors::FitData data = foldData(run, fold, run.fold_alignments[k]);
      for (const std::size_t i : plain) {
        if (run.stopped()) return;
        refit(run, i, k, fold, data, run.fold_alignments[k]);
        meter.add(run.scores.candidates[i].fit_s);
      }
    }});
  return tasks;
}

double totalCost_s(const Run& run) {
  double total_s = 0.0;
  for (std::size_t i = 0; i < run.job.candidates.size(); ++i) {
    const CandidateScores& scores = run.scores.candidates[i];
    if (scores.skipped) continue;
    const Candidate& candidate = run.job.candidates[i];
    const double n_fits = hasClosedForm(run, candidate)     ? 3.0
                          : isTooCostly(run.job, candidate) ? kCostlyFolds
                                                            : static_cast<double>(run.job.folds.size());
    total_s += n_fits * scores.fit_s;
  }
  return total_s;
}

/// The alignment of every fold, and the error that it alone leaves.
Result<void> alignFolds(Run& run) {
  const HeldOutJob& job = run.job;
  HeldOutScores& scores = run.scores;
  scores.before_position.resize(job.scored.size());
  if (job.has_orientation) scores.before_orientation.resize(job.scored.size());
  run.fold_alignments.resize(job.folds.size());
  std::vector<std::optional<Error>> errors(job.folds.size());
  ProgressMeter meter(run.control.progress, kFitted, kAligned, static_cast<double>(job.folds.size()));
  run.control.parallel_for(job.folds.size(), [&](std::size_t k) {
    if (run.stopped()) return;
    const auto alignment = alignmentOf(job, rowsOf(job, job.folds[k].fitted));
    if (!alignment) {
      errors[k] = alignment.error();
      return;
    }
    run.fold_alignments[k] = *alignment;
    for (const std::size_t row : job.folds[k].scored) {
      scores.before_position[run.slots[row]] = alignedPositionScore(job.nodes[row], *alignment);
      if (job.has_orientation)
        scores.before_orientation[run.slots[row]] = alignedOrientationScore(job.nodes[row], *alignment);
    }
    meter.add(1.0);
  });
  for (const std::optional<Error>& error : errors)
    if (error) return tl::unexpected(*error);
  return {};
}

/// What a method that failed with something held out leaves behind.
void keepReasons(Run& run) {
  for (std::size_t i = 0; i < run.why_not.size(); ++i)
    for (const std::optional<std::string>& why : run.why_not[i])
      if (why && !run.scores.candidates[i].skipped) {
        run.scores.candidates[i] = {};
        run.scores.candidates[i].skipped = *why;
      }
}

Result<void> runFolds(Run& run) {
  ProgressMeter meter(run.control.progress, kAligned, 1.0, totalCost_s(run));
  FT_TRY(const auto tasks, makeTasks(run, meter));
  run.control.parallel_for(tasks.size(), [&](std::size_t t) {
    if (!run.stopped()) tasks[t].work();
  });
  if (run.stopped()) return comparisonStopped();
  keepReasons(run);
  for (std::size_t i = 0; i < run.job.candidates.size(); ++i) {
    CandidateScores& scores = run.scores.candidates[i];
    if (scores.skipped || !scores.closed_form || !run.job.candidates[i].is_tuned) continue;
    scores.tuned_inside = false;
    scores.notes.push_back(
        "What it chooses from the data was chosen on all places, and kept while each place was held out.");
  }
  return {};
}

}  // namespace

Result<HeldOutScores> scoreHeldOut(const HeldOutJob& job, const RunControl& control) {
  HeldOutScores scores;
  const std::vector<Node> fitted = rowsOf(job, job.fitted);
  FT_TRY(const auto alignment, alignmentOf(job, fitted));
  Run run{job,    control, slotsOf(job), alignment, calibration::makeFitData(fitted, job.metadata, alignment), {},
          scores, {}};
  scores.dimension = run.all_data.dimension;
  scores.candidates.resize(job.candidates.size());
  run.why_not.resize(job.candidates.size());

  ProgressMeter meter(control.progress, 0.0, kFitted, static_cast<double>(job.candidates.size()));
  const bool is_role = job.validation.kind == ValidationKind::kRole;
  control.parallel_for(job.candidates.size(), [&](std::size_t i) {
    if (run.stopped()) return;
    scores.candidates[i] = fitInSample(job, job.candidates[i], run.all_data, alignment, run.inner());
    scores.candidates[i].validated = job.validation;
    run.why_not[i].resize(job.folds.size());
    if (!is_role) scores.candidates[i].held_out.resize(job.scored.size());
    meter.add(1.0);
  });
  if (run.stopped()) return comparisonStopped();
  FT_TRY_VOID(alignFolds(run));
  if (run.stopped()) return comparisonStopped();
  if (is_role) {
    control.progress(1.0);
    return scores;
  }
  FT_TRY_VOID(runFolds(run));
  return scores;
}

}  // namespace fieldtrue::evaluation
