#include "calib/evaluation/verdict.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/calibration/alignment.h"
#include "calib/calibration/mirrored_sensors.h"
#include "calib/correctors/method_label.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/intervals.h"

namespace fieldtrue::evaluation {
namespace {

constexpr std::size_t kFewestPlaces = 3;
/// Validation places that span less of the box around all places do not stand for the region.
constexpr double kWholeRegion = 0.5;
constexpr const char* kForEachSensor = " with a correction for each sensor";

std::optional<std::size_t> bestRow(const std::vector<MethodScore>& scores, double before_rms,
                                   const Comparison& comparison) {
  std::optional<std::size_t> best;
  double lowest = before_rms;
  for (std::size_t row = 0; row < scores.size(); ++row) {
    if (scores[row].skipped || scores[row].folds_back || !isRanked(scores[row], comparison) ||
        !(scores[row].stats.rms < lowest - kTie))
      continue;
    lowest = scores[row].stats.rms;
    best = row;
  }
  return best;
}

/// To the best, or to no correction where none beats it.
void tellDistanceToBest(std::vector<MethodScore>& scores, std::optional<std::size_t> best_row,
                        const std::vector<double>& before) {
  tellDistanceTo(best_row ? std::as_const(scores)[*best_row].place_errors : before, scores);
}

std::string intervalText(const GainTest& test) {
  if (!std::isfinite(test.low90)) return "no interval";
  const std::string high = percentText(test.high90) + " %";
  if (test.low90 < -1.0) return "90 % interval from an error more than doubled to " + high;
  return "90 % interval " + percentText(test.low90) + " to " + high;
}

/// Why a best method fails the rule; the sentence's middle, without a full stop.
std::string whyNot(const GainTest& test, const Comparison& comparison) {
  const std::size_t n_places = comparison.places.size();
  if (n_places < kFewestPlaces)
    return ", and " + countText(n_places, "place is", "places are") + " too few to judge by";
  if (test.gain < kNeededGain) return ", and at least 10 % is needed";
  if (test.low90 <= 0.0) return ", and the interval does not exclude zero";
  const std::string without = ", and without " + comparison.names.of(test.worst_place) + " it is " +
                              percentText(test.gain_without_worst_place) + " %";
  return test.gain_without_worst_place < kNeededGain ? without + " where 10 % is needed"
                                                     : without + " with an interval that does not exclude zero";
}

std::string placesText(const Comparison& comparison) {
  const std::string text = "on " + countText(comparison.places.size(), "place", "places") + " the fits did not see";
  return comparison.validated_share < kWholeRegion
             ? text + ", which span only " + percentText(comparison.validated_share) + " % of the region"
             : text;
}

/// What a map that turns much of the volume inside out means. A distorted field folds back near metal at most.
std::string insideOutText(const Comparison& comparison) {
  if (!comparison.verdict.mirrored.empty()) return comparison.verdict.mirrored;
  const FoldCount count = foldsOfPlaces(*comparison.fold_back);
  return "the readings are turned inside out " + std::string(comparison.fold_back->n_places > 0 ? "around " : "in ") +
         std::to_string(count.n_folded) + " of " + std::to_string(count.n_judged) +
         (comparison.fold_back->n_places > 0 ? " places" : " cells of the grid") +
         ", far more than a field does: axes are swapped or mirrored, readings stand at places that are not theirs, or "
         "rig or transmitter was moved on the way";
}

/// What the best correction does between the places, where it alone folds back.
std::string foldingText(const FoldBack& fold_back) {
  const FoldCount count = foldsOfCorrection(fold_back);
  return "the correction folds back at " + std::to_string(count.n_folded) + " of " + std::to_string(count.n_judged) +
         " points between the places, though these do not: different readings go to one place there";
}

/// Where a method that is not ranked has the smaller figure, that it was not judged.
std::string unrankedText(const Comparison& comparison) {
  const bool hides_better =
      std::any_of(comparison.position.begin(), comparison.position.end(), [&](const MethodScore& score) {
        return !score.skipped && !isRanked(score, comparison) && score.stats.rms < comparison.before_position_mm.rms;
      });
  return hides_better ? " that " + toText(comparison.validation) + " can judge (kfold:10 judges more)" : std::string();
}

std::string positionText(const Comparison& comparison, const std::string& do_not_apply) {
  const GainTest& test = comparison.verdict.position;
  const bool is_apart = isApart(comparison.split) && !comparison.verdict.is_inside_out;
  const std::string before = errorText(is_apart ? comparison.split->before : comparison.before_position_mm.rms) + " mm";
  if (!comparison.best_position_row)
    return do_not_apply + (comparison.verdict.is_inside_out ? insideOutText(comparison) + "; " : "") + "no method" +
           unrankedText(comparison) + " does better than " +
           (comparison.align == calibration::AlignMode::kRigid ? "the rigid alignment alone" : "the tracker as it is") +
           " (" + before + ") " + placesText(comparison);
  const MethodScore& best = comparison.position[*comparison.best_position_row];
  const std::string name = correctors::positionLabel(best.method, best.settings) + (is_apart ? kForEachSensor : "");
  const std::string after = errorText(is_apart ? comparison.split->separate : best.stats.rms) + " mm";
  if (comparison.verdict.is_inside_out)
    return do_not_apply + name + " would take the error from " + before + " to " + after + " (" +
           placesText(comparison) + "), but " + insideOutText(comparison);
  const bool folds = comparison.fold_back && foldsByItself(*comparison.fold_back);
  if (comparison.verdict.is_folding)
    return do_not_apply + name + " would take the error from " + before + " to " + after + " (" +
           placesText(comparison) + "), but " + foldingText(*comparison.fold_back) +
           ", and places nearer to each other are needed to tell what the field does between them";
  if (test.apply)
    return "Apply " + name + ": error before " + before + ", after " + after + " (" + placesText(comparison) +
           "), gain " + percentText(test.gain) + " % (" + intervalText(test) + ")" +
           (folds ? ", but " + foldingText(*comparison.fold_back) : "");
  return do_not_apply + "the best method, " + name + ", takes the error from " + before + " to " + after + " (" +
         placesText(comparison) + "), a gain of " + percentText(test.gain) + " % (" + intervalText(test) + ")" +
         whyNot(test, comparison);
}

/// "; expect 1.2 mm inside the region and 3.4 mm near its edge, 5.6 mm at worst (C4, pipe 3), limited by ..."
std::string expectationText(const Comparison& comparison) {
  const Verdict& verdict = comparison.verdict;
  if (verdict.worst_node < 0 || verdict.is_inside_out) return {};
  std::string text = "; expect ";
  if (verdict.inside_mm) text += errorText(*verdict.inside_mm) + " mm inside the region";
  if (verdict.edge_mm) text += (verdict.inside_mm ? " and " : "") + errorText(*verdict.edge_mm) + " mm near its edge";
  text += ", " + errorText(verdict.worst_mm) + " mm at worst (" + comparison.names.of(verdict.worst_node) + ")";
  return verdict.limited_by.empty() ? text : text + ", limited by " + verdict.limited_by;
}

std::string orientationText(const Comparison& comparison) {
  if (!comparison.before_orientation_deg || comparison.verdict.is_inside_out) return {};
  const GainTest& test = comparison.verdict.orientation;
  const bool is_apart = isApart(comparison.orientation_split);
  const std::string before =
      errorText(is_apart ? comparison.orientation_split->before : comparison.before_orientation_deg->rms);
  if (!comparison.best_orientation_row) return "; orientation stays as it is (" + before + " degrees)";
  const MethodScore& best = comparison.orientation[*comparison.best_orientation_row];
  const std::string name = correctors::orientationLabel(best.method, best.settings) + (is_apart ? kForEachSensor : "");
  const std::string after = errorText(is_apart ? comparison.orientation_split->separate : best.stats.rms);
  if (test.apply) return "; for orientation apply " + name + ": " + before + " degrees before, " + after + " after";
  return "; orientation stays as it is (" + before + " degrees; the best method, " + name + ", gains " +
         percentText(test.gain) + " %" + whyNot(test, comparison) + ")";
}

}  // namespace

GainTest testGain(const std::vector<int>& places, const std::vector<double>& before, const std::vector<double>& after,
                  const FitFreedom& freedom) {
  FT_CHECK(places.size() == before.size() && before.size() == after.size());
  GainTest test;
  if (places.empty()) return test;
  const PairedGain all = pairedGain(before, after, freedom);
  test.gain = all.gain;
  test.low90 = all.low90;
  test.high90 = all.high90;
  const std::size_t worst = worstPlace(before, after);
  test.worst_place = places[worst];
  test.gain_without_worst_place = test.low90_without_worst_place = std::nan("");
  if (places.size() < kFewestPlaces) return test;
  const auto without = [&](std::vector<double> errors) {
    errors.erase(errors.begin() + static_cast<std::ptrdiff_t>(worst));
    return errors;
  };
  const PairedGain rest = pairedGain(without(before), without(after), freedom);
  test.gain_without_worst_place = rest.gain;
  test.low90_without_worst_place = rest.low90;
  test.apply = all.low90 > 0.0 && all.gain >= kNeededGain && rest.low90 > 0.0 && rest.gain >= kNeededGain;
  return test;
}

bool isRanked(const MethodScore& score, const Comparison& comparison) {
  return score.tuned_inside && score.validated == comparison.validation;
}

void tellDistanceTo(const std::vector<double>& of_best, std::vector<MethodScore>& scores) {
  for (MethodScore& score : scores) {
    if (score.skipped) continue;
    const PairedDifference difference = pairedDifference(score.place_errors, of_best, score.freedom.positions_a_place);
    score.rms_to_best = difference.difference;
    score.rms_to_best_low90 = difference.low90;
    score.rms_to_best_high90 = difference.high90;
  }
}

double excessError(double rms, double floor) { return std::sqrt(std::max(0.0, rms * rms - floor * floor)); }

void judgePosition(Verdict& verdict, const GainTest& test) {
  verdict.position = test;
  verdict.apply_position = test.apply;
  verdict.gain_low90 = test.low90;
  verdict.gain_high90 = test.high90;
  verdict.gain_without_worst_place = test.gain_without_worst_place;
}

void pickBest(Comparison& comparison) {
  Verdict& verdict = comparison.verdict;
  Trueness& trueness = comparison.trueness;
  comparison.best_position_row = bestRow(comparison.position, comparison.before_position_mm.rms, comparison);
  trueness.before_position_mm = excessError(comparison.before_position_mm.rms, comparison.floor_position_mm);
  trueness.after_position_mm = trueness.before_position_mm;
  if (const auto row = comparison.best_position_row) {
    const MethodScore& best = comparison.position[*row];
    comparison.best_position = best.method;
    comparison.after_sensors = best.sensors;
    judgePosition(verdict, testGain(comparison.places, comparison.before_place_mm, best.place_errors, best.freedom));
    trueness.after_position_mm = excessError(best.stats.rms, comparison.floor_position_mm);
  }
  if (comparison.before_orientation_deg) {
    comparison.best_orientation_row =
        bestRow(comparison.orientation, comparison.before_orientation_deg->rms, comparison);
    trueness.before_orientation_deg =
        excessError(comparison.before_orientation_deg->rms, comparison.floor_orientation_deg);
    trueness.after_orientation_deg = trueness.before_orientation_deg;
  }
  if (const auto row = comparison.best_orientation_row) {
    const MethodScore& best = comparison.orientation[*row];
    comparison.best_orientation = best.method;
    verdict.orientation = testGain(comparison.places, comparison.before_place_deg, best.place_errors, best.freedom);
    trueness.after_orientation_deg = excessError(best.stats.rms, comparison.floor_orientation_deg);
  }
  tellDistanceToBest(comparison.position, comparison.best_position_row, comparison.before_place_mm);
  tellDistanceToBest(comparison.orientation, comparison.best_orientation_row, comparison.before_place_deg);
  verdict.apply_orientation = verdict.orientation.apply;
}

void noteFloors(Comparison& comparison) {
  if (comparison.before_position_mm.rms <= comparison.floor_position_mm)
    comparison.notes.push_back("The position error before correction is no larger than noise and jig tolerance make.");
  if (const auto row = comparison.best_position_row;
      row && kOverstatedFloor * comparison.position[*row].stats.rms < comparison.floor_position_mm)
    comparison.notes.push_back("The noise floor, " + errorText(comparison.floor_position_mm) + " mm from " +
                               comparison.floor_from + ", is far above what is left after correction, " +
                               errorText(comparison.position[*row].stats.rms) +
                               " mm: what the table states is too large or in another unit than metres.");
}

void refuseInsideOut(Comparison& comparison, std::span<const Node> nodes) {
  Verdict& verdict = comparison.verdict;
  verdict.mirrored = calibration::mirroredText(nodes);
  const auto& fold_back = comparison.fold_back;
  verdict.is_inside_out = !verdict.mirrored.empty() || (fold_back && foldsOfPlaces(*fold_back).isTooMany());
  verdict.is_folding = !verdict.is_inside_out && fold_back && foldsOfCorrection(*fold_back).isTooMany();
  if (verdict.is_inside_out || verdict.is_folding) verdict.apply_position = verdict.position.apply = false;
  if (verdict.is_inside_out) verdict.apply_orientation = verdict.orientation.apply = false;
}

void writeVerdictText(Comparison& comparison) {
  Verdict& verdict = comparison.verdict;
  const std::string do_not_apply =
      verdict.apply_orientation ? "Do not apply a position correction: " : "Do not apply: ";
  verdict.text =
      positionText(comparison, do_not_apply) + expectationText(comparison) + orientationText(comparison) + ".";
}

}  // namespace fieldtrue::evaluation
