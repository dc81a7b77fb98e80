#include "calib/evaluation/surroundings.h"

#include <algorithm>
#include <utility>

#include "calib/calibration/alignment.h"
#include "calib/calibration/coincident_places.h"
#include "calib/calibration/corrector.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/regrid/regrid_error.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/held_out_job.h"
#include "calib/evaluation/limits.h"
#include "calib/evaluation/region/region_lattice.h"
#include "calib/evaluation/verdict.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::evaluation {
namespace {

Result<void> unlessStopped(const RunControl& control, double done) {
  control.progress(done);
  if (control.stop.stop_requested()) return comparisonStopped();
  return {};
}

/// A position method fitted to all rows it may see, no correction where none is told; none where that fails.
Result<std::optional<FoldBack>> foldBack(std::optional<std::size_t> row, const Comparison& comparison,
                                         const HeldOutJob& job, const RunControl& control) {
  calibration::CorrectorChoice choice;
  if (row) {
    choice.position_id = comparison.position[*row].method;
    choice.position_settings = comparison.position[*row].settings;
  }
  const auto corrector = calibration::Corrector::fit(rowsOf(job, job.fitted), job.metadata, choice, job.align, control);
  if (!corrector && corrector.error().code == ErrorCode::kCancelled) return tl::unexpected(corrector.error());
  if (!corrector) return std::optional<FoldBack>();
  return std::optional(foldBackOf(*corrector));
}

/// Methods that err as little as the best, as far as these places tell, the better ones first.
std::vector<std::size_t> asGoodAsBest(const Comparison& comparison) {
  const std::vector<MethodScore>& scores = comparison.position;
  const double most_mm = (1.0 + kNeededGain) * scores[*comparison.best_position_row].stats.rms;
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < scores.size(); ++row)
    if (row != *comparison.best_position_row && !scores[row].skipped && isRanked(scores[row], comparison) &&
        scores[row].stats.rms <= most_mm && scores[row].rms_to_best_low90 <= 0.0)
      rows.push_back(row);
  std::stable_sort(rows.begin(), rows.end(),
                   [&](std::size_t a, std::size_t b) { return scores[a].stats.rms < scores[b].stats.rms; });
  return rows;
}

/// Asks whether the best correction folds back; where it does so by itself and another that is as good does not, that
/// one is the best.
Result<void> judgeFolds(Comparison& comparison, const HeldOutJob& job, const RunControl& control) {
  FT_TRY(comparison.fold_back, foldBack(comparison.best_position_row, comparison, job, control));
  if (!comparison.best_position_row || !comparison.fold_back || !foldsByItself(*comparison.fold_back)) return {};
  std::vector<std::size_t> folding = {*comparison.best_position_row};
  for (const std::size_t row : asGoodAsBest(comparison)) {
    FT_TRY(auto fold_back, foldBack(row, comparison, job, control));
    if (!fold_back) continue;
    if (foldsByItself(*fold_back)) {
      folding.push_back(row);
      continue;
    }
    for (const std::size_t one : folding) {
      MethodScore& score = comparison.position[one];
      score.folds_back = true;
      score.notes.push_back(
          "Folds back between the places: different readings go to one place there. Another method errs as little and "
          "does not.");
    }
    comparison.fold_back = std::move(fold_back);
    pickBest(comparison);
    break;
  }
  return {};
}

/// What each way to bring the measured errors to a grid costs by itself.
std::vector<ResamplingError> resamplingErrors(const Comparison& comparison, const HeldOutJob& job,
                                              const RunControl& control) {
  const std::vector<Node> fitted = rowsOf(job, job.fitted);
  const auto alignment = alignmentOf(job, fitted);
  if (!alignment) return {};
  const correctors::FitData data = calibration::makeFitData(fitted, job.metadata, *alignment);
  if (data.dimension < 3) return {};
  std::vector<ResamplingError> errors;
  for (const correctors::RegridMethod method :
       {correctors::RegridMethod::kBriggs, correctors::RegridMethod::kLivingston,
        correctors::RegridMethod::kCzernuszenko}) {
    correctors::RegridOptions options;
    options.method = method;
    options.pitch_m = medianSpacing_m(correctors::mergePlaces(data).p_tracked_m);
    const correctors::RegridError error = correctors::regridError(data, options, control);
    if (control.stop.stop_requested()) return {};
    errors.push_back({correctors::regridMethodId(method), error.rms_mm, static_cast<int>(error.n_scored),
                      static_cast<int>(error.n_without_support),
                      excessError(error.rms_mm, comparison.floor_position_mm)});
  }
  return errors;
}

/// Rows of one true position are one place; skipped ones stay what they are.
CalibrationTable withPlacesJoined(const CalibrationTable& table) {
  CalibrationTable joined{table.metadata, {}}, skipped{table.metadata, {}};
  for (const Node& node : table.nodes) (node.role == NodeRole::kSkipped ? skipped : joined).nodes.push_back(node);
  calibration::joinCoincidentPlaces(joined.nodes);
  joined.nodes.insert(joined.nodes.end(), skipped.nodes.begin(), skipped.nodes.end());
  return joined;
}

/// None where it cannot be asked.
Result<std::optional<OrientationDependence>> dependenceOn(const HeldOutJob& job, PosePart part,
                                                          const RunControl& control) {
  auto dependence = orientationDependence({job.metadata, job.nodes}, part, job.seed, control);
  if (dependence) return std::optional(*std::move(dependence));
  if (dependence.error().code == ErrorCode::kCancelled) return tl::unexpected(dependence.error());
  return std::optional<OrientationDependence>();
}

}  // namespace

Result<void> addSurroundings(Comparison& comparison, const CalibrationTable& table, const HeldOutJob& job,
                             const RunControl& control) {
  RunControl quiet = control;
  quiet.progress = [](double) {};
  comparison.coverage = coverageOf(withPlacesJoined(table));
  if (auto going = unlessStopped(control, 0.1); !going) return going;
  FT_TRY_VOID(judgeFolds(comparison, job, quiet));
  refuseInsideOut(comparison, job.nodes);
  judgePlaces(comparison);
  if (auto going = unlessStopped(control, 0.4); !going) return going;
  if (job.has_orientation) {
    comparison.orientation_cover = orientationCover(CalibrationTable{job.metadata, job.nodes});
    FT_TRY(comparison.position_dependence, dependenceOn(job, PosePart::kPosition, quiet));
    FT_TRY(comparison.orientation_dependence, dependenceOn(job, PosePart::kOrientation, quiet));
  }
  if (auto going = unlessStopped(control, 0.6); !going) return going;
  comparison.resampling = resamplingErrors(comparison, job, quiet);
  if (auto going = unlessStopped(control, 0.8); !going) return going;
  FT_TRY(const auto with_half_mm, comparison.verdict.apply_position ? rmsWithHalf_mm(comparison, job, quiet)
                                                                    : Result<std::optional<double>>(std::nullopt));
  if (!comparison.verdict.is_inside_out && !comparison.verdict.is_folding)
    comparison.verdict.limited_by = limitedBy(comparison, job, with_half_mm);
  return unlessStopped(control, 1.0);
}

}  // namespace fieldtrue::evaluation
