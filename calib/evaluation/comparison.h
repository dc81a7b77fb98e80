#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/place_name.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/error_stats.h"
#include "calib/evaluation/orientation/orientation_cover.h"
#include "calib/evaluation/orientation/orientation_dependence.h"
#include "calib/evaluation/region/coverage.h"
#include "calib/evaluation/region/fold_back.h"

namespace fieldtrue::evaluation {

enum class ValidationKind { kRole, kLeaveOneOut, kFolds, kBlocks };
struct Validation {
  ValidationKind kind = ValidationKind::kLeaveOneOut;
  int count = 0;  ///< Folds or blocks.
  bool operator==(const Validation&) const = default;
};

/// Reads `role`, `loo`, `kfold:10`, `block:8`. @error kBadInput
Result<Validation> parseValidation(const std::string& text);
/// `role` where the table has validation rows; else `loo`, or `kfold:10` where a method takes part that must be fitted
/// anew without the places it is judged at, because its fits are tuned by them or costly.
Validation defaultValidation(const CalibrationTable& table, bool needs_refits);
std::string toText(const Validation& validation);

struct ComparisonOptions {
  std::vector<MethodText> position_methods;     ///< Empty = all of the registry with default settings.
  std::vector<MethodText> orientation_methods;  ///< Empty = all.
  std::optional<Validation> validation;         ///< None = defaultValidation.
  std::optional<calibration::AlignMode> align;  ///< None = defaultAlignMode.
  std::uint64_t seed = 1;                       ///< Of folds.
  /// Coverage, fold-back, dependence on orientation and what limits the best method, beside the scores. Without them
  /// only the scores and the rule of application are found.
  bool with_surroundings = true;
  /// Every method is fitted to each sensor's rows alone, beyond the alignment that all rows share.
  bool separate_sensors = false;
  bool closed_form = true;  ///< False refits every fold of every method: the slow way, for checking the fast one.
};

/// What is left at one sensor's rows, where the table holds several sensors.
struct SensorScore {
  int sensor = 0;
  std::vector<int> places;           ///< Node numbers.
  std::vector<double> place_errors;  ///< Of each place.
  ErrorStats stats;                  ///< mm or deg.
};

/// One method's score on the places its fits did not see.
struct MethodScore {
  std::string method;
  Settings settings;
  ErrorStats stats;                  ///< mm or deg, over all scored places.
  std::optional<ErrorStats> inside;  ///< Over the places that have others on all sides; none where there are none.
  std::optional<ErrorStats> edge;    ///< Over the outermost places.
  std::vector<double> place_errors;  ///< Same order as Comparison::places.
  std::vector<Eigen::Vector3d>
      residual_m;  ///< Position only: corrected minus true at each place, reference frame (mean over its rows).
  std::vector<SensorScore> sensors;  ///< In order; empty where there is one.
  std::vector<bool> place_covered;   ///< Same order; where false the input stood unchanged.
  int n_uncovered = 0;
  double rms_common_mm = 0;  ///< Position only: over the places all methods cover; not a number where there is none.
  double rms_to_best = 0;    ///< RMS minus the best method's, mm or deg, with its paired 90 % interval.
  double rms_to_best_low90 = 0;
  double rms_to_best_high90 = 0;
  Validation validated;  ///< What it was scored with; not the comparison's for a costly method under loo.
  FitFreedom freedom;
  bool tuned_inside = true;            ///< Its fits chose nothing from the places they were scored on.
  bool folds_back = false;             ///< Another is as good and does not: never called best.
  int n_folds = 0;                     ///< Fits that were scored; fewer than asked for a costly method.
  bool closed_form = false;            ///< Held out by downdating one fit rather than by fitting anew.
  double in_sample_rms = 0;            ///< On the rows it was fitted to, all at once. Not a verdict.
  double fit_s = 0;                    ///< One fit on all rows.
  double eval_ns = 0;                  ///< One evaluation.
  std::optional<std::string> skipped;  ///< Why it cannot be used here; then nothing else is set.
  std::vector<std::string> notes;
};

/// Whether a correction is worth applying: the paired 90 % interval of its gain excludes zero and the gain is at least
/// 10 %, also without the place whose removal lowers the gain most.
struct GainTest {
  double gain = 0;  ///< 1 - RMS after / RMS before, over the places scored.
  double low90 = 0;
  double high90 = 0;
  int worst_place = -1;                 ///< Node number; -1 = nothing was tested.
  double gain_without_worst_place = 0;  ///< Not a number where there are too few places to leave one out.
  double low90_without_worst_place = 0;
  bool apply = false;
};

/// Whether each sensor corrected by itself, from its own rows beyond one alignment, errs less than with the correction
/// that all share: RMS over the sensors of a place, both at places that the same fits did not see.
struct SensorSplit {
  double shared = 0;    ///< mm, or degrees of an orientation.
  double separate = 0;  ///< The same unit.
  PairedDifference separate_less_shared;
  /// The same of errors as shares of what the shared correction leaves of each sensor, so that one that is noisy does
  /// not hide what another gains; a number, not a unit.
  PairedDifference separate_less_shared_in_shares;
  /// Separate: the RMS is lower by 5 % at least, in the unit or, where one sensor errs far more than another, in shares
  /// (and then no higher in the unit), with the paired 90 % interval of that difference below zero.
  bool is_better = false;
  bool is_told = true;               ///< False where a sensor cannot be fitted by itself; then only the text is set.
  GainTest gain;                     ///< Of the separate corrections, over no correction.
  double before = 0;                 ///< RMS with no correction, at the same places.
  std::vector<double> after;         ///< Of each place with separate corrections; same order as Comparison::places.
  std::vector<SensorScore> sensors;  ///< With separate corrections.
  std::string text;                  ///< One sentence.
};

/// Whether each sensor is to have a correction of its own: better than one for all, and better than none.
inline bool isApart(const std::optional<SensorSplit>& split) {
  return split && split->is_better && split->separate < split->before;
}

/// @param places node numbers, before and after in the same order; fewer than 3 never pass
GainTest testGain(const std::vector<int>& places, const std::vector<double>& before, const std::vector<double>& after,
                  const FitFreedom& freedom = {});

struct Verdict {
  bool apply_position = false;
  bool apply_orientation = false;
  bool is_inside_out = false;  ///< Much of the volume is: axes or places of the readings are wrong. Nothing applies.
  bool is_folding = false;     ///< The best correction alone folds back over much of the volume: it is not applied.
  std::string mirrored;        ///< Where some sensors' readings are mirror images of their places, who and why.
  double gain_low90 = 0;       ///< Of the best position method: 1 - RMS after / RMS before, over the same places.
  double gain_high90 = 0;
  double gain_without_worst_place = 0;
  GainTest position;     ///< Of the best position method.
  GainTest orientation;  ///< Of the best orientation method.
  /// Held-out RMS of what the verdict recommends (the best position method, or no correction) over the places that have
  /// others on all sides, and over the outermost ones; none where there are no such places.
  std::optional<double> inside_mm;
  std::optional<double> edge_mm;
  int worst_node = -1;     ///< Place with the largest of these errors; -1 = nothing was scored.
  double worst_mm = 0;     ///< Its error.
  std::string limited_by;  ///< One phrase: what keeps the error from being smaller. Empty without surroundings.
  std::string text;        ///< One sentence.
};

/// Systematic error apart from precision: sqrt(max(0, RMS^2 - floor^2)), what noise and jig do not explain.
struct Trueness {
  double before_position_mm = 0;
  double after_position_mm = 0;                  ///< Of the best position method; as before where nothing beats it.
  std::optional<double> before_orientation_deg;  ///< None without orientation.
  std::optional<double> after_orientation_deg;
};

/// What bringing the measured errors to other positions costs by itself, by leaving each place out in turn; the other
/// places stand twice as far as for a node between them.
struct ResamplingError {
  std::string method;         ///< Id of a RegridMethod.
  double rms_mm = 0;          ///< Over the places with support.
  int n_scored = 0;           ///< Places with support.
  int n_without_support = 0;  ///< Not extrapolated.
  double excess_mm = 0;       ///< Above the noise floor.
};

/// sqrt(max(0, rms^2 - floor^2)).
double excessError(double rms, double floor);

struct Comparison {
  Validation validation;
  calibration::AlignMode align = calibration::AlignMode::kNone;
  std::vector<int> places;       ///< Node numbers scored.
  std::vector<bool> is_edge;     ///< Of each: whether it is an outermost place.
  double positions_a_place = 1;  ///< @see FitFreedom
  PlaceNames names;              ///< What the places of the table are called.
  double validated_share = 1.0;  ///< Volume of the box around the scored places, of that around all places.
  int n_places = 0;              ///< In the table, skipped ones left out.
  int validation_places = 0;     ///< Scored by fits that did not see them; the size of `places`.
  double floor_position_mm = 0;  ///< 0 = the table states neither noise nor tolerance.
  double floor_orientation_deg = 0;
  std::string floor_from;  ///< "samples and jig tolerance", and the like.
  ErrorStats before_position_mm;
  std::optional<ErrorStats> before_orientation_deg;  ///< None without orientation.
  std::vector<SensorScore> before_sensors;           ///< Of positions; empty with one sensor.
  std::vector<SensorScore> after_sensors;  ///< With the best position method, as the verdict has it; empty without one.
  std::vector<double> before_place_mm;
  std::vector<double> before_place_deg;  ///< Empty without orientation.
  std::vector<Eigen::Vector3d> before_residual_m;
  std::vector<MethodScore> position;
  std::vector<MethodScore> orientation;
  std::optional<std::size_t> best_position_row;     ///< Into `position`; none where nothing beats the error before.
  std::optional<std::size_t> best_orientation_row;  ///< Into `orientation`.
  std::string best_position = "none";
  std::string best_orientation = "none";
  Verdict verdict;
  Trueness trueness;
  std::optional<Coverage> coverage;                   ///< These need ComparisonOptions::with_surroundings.
  std::optional<FoldBack> fold_back;                  ///< With the best position method fitted to all rows it may see.
  std::optional<OrientationCover> orientation_cover;  ///< None without orientation; the next two likewise.
  /// Whether the errors depend on how the sensor is held.
  std::optional<OrientationDependence> position_dependence;
  std::optional<OrientationDependence> orientation_dependence;
  std::vector<ResamplingError> resampling;  ///< Empty for places in one plane.
  /// Of the best methods, or of those that come nearest where none beats the error before; none with one sensor.
  std::optional<SensorSplit> split;
  std::optional<SensorSplit> orientation_split;
  std::vector<std::string> notes;  ///< E.g. that the nodes lie in one plane.
};

/// Scores every method on places its fits did not see.
/// @error kTooFewNodes, kDegenerate when even the alignment cannot be fitted; kBadInput for unknown methods; kCancelled
Result<Comparison> compareMethods(const CalibrationTable& table, const ComparisonOptions& options,
                                  const RunControl& control = {});

/// `fieldtrue.compare/1`.
nlohmann::json toJson(const Comparison& comparison);

}  // namespace fieldtrue::evaluation
