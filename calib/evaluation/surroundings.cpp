#include "calib/evaluation/surroundings.h"

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

/// The best position method fitted to all rows it may see; none where that fails.
Result<std::optional<FoldBack>> foldBack(const Comparison& comparison, const HeldOutJob& job,
                                         const RunControl& control) {
  calibration::CorrectorChoice choice;
  if (const auto row = comparison.best_position_row) {
    choice.position_id = comparison.position[*row].method;
    choice.position_settings = comparison.position[*row].settings;
  }
  const auto corrector = calibration::Corrector::fit(rowsOf(job, job.fitted), job.metadata, choice, job.align, control);
  if (!corrector && corrector.error().code == ErrorCode::kCancelled) return tl::unexpected(corrector.error());
  if (!corrector) return std::optional<FoldBack>();
  return std::optional(foldBackOf(*corrector));
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
  auto fold_back = foldBack(comparison, job, quiet);
  if (!fold_back) return tl::unexpected(fold_back.error());
  comparison.fold_back = *std::move(fold_back);
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
  if (!comparison.verdict.is_inside_out) comparison.verdict.limited_by = limitedBy(comparison, job, with_half_mm);
  return unlessStopped(control, 1.0);
}

}  // namespace fieldtrue::evaluation
