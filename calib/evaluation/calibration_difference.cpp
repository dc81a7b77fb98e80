#include "calib/evaluation/calibration_difference.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "calib/core/json_reader.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/method_text.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/common_readings.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/correction_change.h"
#include "calib/evaluation/judged_calibration.h"
#include "calib/geometry/geometry.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {

namespace {

using calibration::Corrector;

constexpr std::size_t kFewestPlaces = 6;
/// Times the largest error of the first at places of its own: farther off, the sensor slipped or the field changed.
constexpr double kFar = 3.0;
constexpr double kRare = 0.01;

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

PlaceErrors placeErrors(std::vector<double> errors_mm, const FitFreedom& freedom) {
  PlaceErrors errors;
  errors.rms_mm = errors_mm.empty() ? 0.0 : rootMeanSquare(errors_mm);
  errors.rms_90_mm = errors_mm.empty() ? Interval{} : rmsInterval90(errors_mm, freedom);
  errors.mm = std::move(errors_mm);
  return errors;
}

PlaceErrors ownErrors(const MethodScore* score) {
  return score ? placeErrors(score->place_errors, score->freedom) : PlaceErrors{};
}

struct PlaceError {
  double mm = 0.0;
  Eigen::Vector3d true_m = Eigen::Vector3d::Zero();
};

/// RMS error of a calibration at each place of another's rows that it covers, alignment fitted anew to them unless
/// both know it. Empty where the places are too few.
std::map<int, PlaceError> errorsAt(const Corrector& corrector, const Corrector& other) {
  std::vector<Eigen::Vector3d> corrected_m, true_m;
  std::vector<int> places;
  for (const Node& node : other.table().nodes) {
    if (!corrector.covers(node.tracker_from_sensor.position_m)) continue;
    const bool takes_pose = corrector.takesOrientation() && node.has_orientation;
    corrected_m.push_back(takes_pose ? corrector.correct(node.tracker_from_sensor).position_m
                                     : corrector.correctPosition_m(node.tracker_from_sensor.position_m));
    true_m.push_back(node.reference_from_sensor.position_m);
    places.push_back(node.node);
  }
  const bool are_frames_known =
      corrector.align() == calibration::AlignMode::kNone && other.align() == calibration::AlignMode::kNone;
  const Result<Pose> moved = are_frames_known ? Pose{} : fitRigid(corrected_m, true_m);
  if (!moved) return {};
  std::map<int, std::vector<double>> by_place;
  std::map<int, PlaceError> errors;
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::vector<double>& of_rows_mm = by_place[places[i]];
    of_rows_mm.push_back(kMmPerM * (*moved * corrected_m[i] - true_m[i]).norm());
    errors[places[i]] = {rootMeanSquare(of_rows_mm), true_m[i]};
  }
  return errors.size() < kFewestPlaces ? std::map<int, PlaceError>() : errors;
}

/// Holds the first calibration against the second's rows.
void measureAtPlaces(const Corrector& first, const Corrector& second, const MethodScore& second_score,
                     const Comparison& of_second, CalibrationDifference& to) {
  const std::map<int, PlaceError> at_second = errorsAt(first, second);
  std::vector<double> first_mm, second_mm;
  for (std::size_t k = 0; k < of_second.places.size(); ++k) {
    const auto found = at_second.find(of_second.places[k]);
    if (found == at_second.end()) continue;
    if (first_mm.empty() || found->second.mm > largest(first_mm)) {
      to.worst_place = of_second.names.of(found->first);
      to.worst_place_m = found->second.true_m;
    }
    first_mm.push_back(found->second.mm);
    second_mm.push_back(second_score.place_errors[k]);
  }
  to.first_at_second = placeErrors(std::move(first_mm), {});
  const std::vector<double>& at_mm = to.first_at_second.mm;
  const double most_own_mm = to.first_own.mm.empty() ? INFINITY : largest(to.first_own.mm);
  const auto n_above = [&](double limit_mm) {
    return static_cast<std::size_t>(
        std::count_if(at_mm.begin(), at_mm.end(), [&](double error_mm) { return error_mm > limit_mm; }));
  };
  to.n_beyond = n_above(most_own_mm);
  to.n_far = n_above(kFar * most_own_mm);
  if (!at_mm.empty()) to.first_less_second_mm = pairedDifference(at_mm, second_mm);
}

/// The chance that so many of the largest errors all fall to the second's places where nothing changed and each place
/// is as likely as any other to have them.
/// @source Rosenbaum 1954, Annals of Mathematical Statistics 25
double chanceOfLargest(std::size_t n_largest, std::size_t n_there, std::size_t n_own) {
  double chance = 1.0;
  for (std::size_t k = 0; k < n_largest; ++k)
    chance *= static_cast<double>(n_there - k) / static_cast<double>(n_there + n_own - k);
  return chance;
}

double chanceOfLargest(const CalibrationDifference& difference) {
  return chanceOfLargest(difference.n_beyond, difference.first_at_second.mm.size(), difference.first_own.mm.size());
}

/// The smallest change that, evenly spread, brings so many of the second's places beyond the first's own as is rare;
/// infinite where no number of them is.
double countedFrom_mm(const PlaceErrors& there, const PlaceErrors& own) {
  if (own.mm.empty()) return INFINITY;
  std::vector<double> falling_mm = there.mm;
  std::sort(falling_mm.begin(), falling_mm.end(), std::greater<>());
  for (std::size_t n = 1; n <= falling_mm.size(); ++n)
    if (chanceOfLargest(n, falling_mm.size(), own.mm.size()) < kRare)
      return excessError(largest(own.mm), falling_mm[n - 1]);
  return INFINITY;
}

/// The largest change that would not be seen: evenly spread, it would neither bring the intervals apart nor many places
/// beyond the first's own.
double unseen_mm(const CalibrationDifference& difference) {
  const PlaceErrors& there = difference.first_at_second;
  const PlaceErrors& own = difference.first_own;
  return std::min(excessError(own.rms_90_mm.high * there.rms_mm / there.rms_90_mm.low, there.rms_mm),
                  countedFrom_mm(there, own));
}

DifferenceVerdict verdictOn(const CalibrationDifference& difference) {
  const PlaceErrors& there = difference.first_at_second;
  const PlaceErrors& own = difference.first_own;
  if (there.mm.empty() || own.mm.empty() || !difference.first_less_second_mm) return DifferenceVerdict::kCannotTell;
  const bool is_apart = there.rms_90_mm.low > own.rms_90_mm.high;
  if ((is_apart && difference.first_less_second_mm->low90 > 0.0) || chanceOfLargest(difference) < kRare)
    return DifferenceVerdict::kChanged;
  return is_apart || difference.n_far > 0 ? DifferenceVerdict::kCannotTell : DifferenceVerdict::kNotShown;
}

std::string withInterval(const PlaceErrors& errors) {
  return errorText(errors.rms_mm) + " mm (" + errorText(errors.rms_90_mm.low) + " to " +
         errorText(errors.rms_90_mm.high) + ")";
}

std::string when(const CalibrationDifference& difference) {
  const auto first = factOf(difference.first_setup, "date"), second = factOf(difference.second_setup, "date");
  if (!first || !second || *first == *second) return "between the two recordings";
  return "between " + *first + " and " + *second;
}

/// What the largest errors tell; empty where they tell nothing.
std::string beyond(const CalibrationDifference& difference) {
  if (difference.n_beyond == 0) return {};
  return "; " + std::to_string(difference.n_beyond) +
         (difference.n_beyond == 1 ? " of the second's places is" : " of the second's places are") +
         " worse than any of its own, most " + difference.worst_place + " at " + pointText(difference.worst_place_m) +
         (difference.n_far > 0 ? "; " + std::to_string(difference.n_far) + " more than three times as bad" : "");
}

/// " in 12 orientations that both were fitted on"; empty where neither correction takes any.
std::string inOrientations(const CalibrationDifference& difference) {
  if (difference.n_orientations == 0) return {};
  const bool is_one = difference.n_orientations == 1;
  return " in " + countText(difference.n_orientations, "orientation", "orientations") + " that " +
         (difference.is_held_seen_by_both ? "both were"
          : is_one                        ? "one of them was"
                                          : "either was") +
         " fitted on";
}

std::string sentences(const CalibrationDifference& difference) {
  const ChangeAt& worst = difference.points[difference.worst];
  const std::string field = " The corrections differ by " + errorText(difference.rms_mm) +
                            " mm RMS over the common region" + inOrientations(difference) + ", most, " +
                            errorText(difference.max_mm) + " mm, at " + pointText(worst.reference_m) +
                            (worst.held ? " with the sensor held as " + turnText(*worst.held) : "") + ".";
  const std::string other =
      difference.setup_matches == SetupMatch::kNo
          ? " They are of different set-ups: " + differenceText(difference.first_setup, difference.second_setup) + "."
          : std::string();
  const std::string unknown = "Nobody can tell whether the field changed: ";
  if (difference.first_own.mm.empty() || difference.second_own.mm.empty())
    return unknown +
           "a calibration of so few places, or of another program, cannot be judged at places its fits did not see." +
           field + other;
  if (difference.first_at_second.mm.empty())
    return unknown + "too few places of the second lie where the first holds." + field + other;
  const std::string errs = "the first errs by " + withInterval(difference.first_at_second) +
                           " at the second's places, and by " + withInterval(difference.first_own) +
                           " at places of its own that its fits did not see" + beyond(difference) + ".";
  switch (difference.verdict) {
    case DifferenceVerdict::kChanged:
      return "The field changed " + when(difference) + ": " + errs + field + other;
    case DifferenceVerdict::kNotShown:
      return "No change is shown, and one of up to " + errorText(*difference.unseen_mm) +
             " mm RMS everywhere would not show: " + errs + field + other;
    case DifferenceVerdict::kCannotTell:
      break;
  }
  const std::string ask = difference.n_far > 0 ? " Take the places again that are farthest off: the sensor slipped "
                                                 "there, or something stands near them."
                                               : "";
  return unknown + errs + field + ask + other;
}

std::string_view nameOf(DifferenceVerdict verdict) {
  switch (verdict) {
    case DifferenceVerdict::kChanged:
      return "changed";
    case DifferenceVerdict::kNotShown:
      return "not_shown";
    case DifferenceVerdict::kCannotTell:
      break;
  }
  return "cannot_tell";
}

nlohmann::json orNull(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

nlohmann::json nullUnlessTold(const std::string& text) {
  return text.empty() ? nlohmann::json(nullptr) : nlohmann::json(text);
}

nlohmann::json orientationsOf(const CalibrationDifference& difference) {
  if (difference.n_orientations == 0) return nullptr;
  return difference.is_held_seen_by_both ? "both" : "either";
}

nlohmann::json toJson(const PlaceErrors& errors) {
  if (errors.mm.empty()) return nullptr;
  return {{"places", errors.mm.size()},
          {"rms_mm", errors.rms_mm},
          {"rms_low90_mm", errors.rms_90_mm.low},
          {"rms_high90_mm", errors.rms_90_mm.high}};
}

nlohmann::json setupDifferencesToJson(const Setup& first, const Setup& second) {
  nlohmann::json list = nlohmann::json::array();
  for (const SetupFact& fact : differences(first, second))
    list.push_back({{"key", fact.key}, {"first", *factOf(first, fact.key)}, {"second", *factOf(second, fact.key)}});
  return list;
}

}  // namespace

Result<std::vector<int>> sensorsToChooseFrom(const Corrector& first, const Corrector& second) {
  if (first.sensorsApart().empty() && second.sensorsApart().empty()) return std::vector<int>();
  const std::vector<int> of_first = sensorsOf(first.table()), of_second = sensorsOf(second.table());
  std::vector<int> of_both;
  std::set_intersection(of_first.begin(), of_first.end(), of_second.begin(), of_second.end(),
                        std::back_inserter(of_both));
  if (of_both.empty())
    return fail(ErrorCode::kUnsupported, "The two calibrations have no sensor in common: one was fitted on " +
                                             sensorsText(of_first) + ", the other on " + sensorsText(of_second));
  return of_both;
}

Result<CalibrationDifference> compareCalibrations(const Corrector& first, const Corrector& second,
                                                  const RunControl& control) {
  for (const Corrector* one : {&first, &second})
    if (!one->sensorsApart().empty())
      return fail(ErrorCode::kUnsupported, "A calibration holds a correction for each of " +
                                               sensorsText(one->sensorsApart()) +
                                               ": compare one sensor at a time, with --sensor N");
  const CommonReadings common = commonReadings(first, second);
  if (common.points_m.empty())
    return fail(ErrorCode::kUnsupported,
                "The two calibrations cover no reading in common: they are of different trackers, or of different "
                "places before the transmitter");
  CalibrationDifference difference;
  difference.first_setup = first.setup();
  difference.second_setup = second.setup();
  difference.setup_matches = match(first.setup(), second.setup());
  measureField(first, second, common, difference);
  measureOrientation(first, second, common, difference);
  RunControl half = control;
  half.progress = [&](double fraction) { control.progress(0.5 * fraction); };
  const Result<Comparison> of_first = judgeCalibration(first, half);
  half.progress = [&](double fraction) { control.progress(0.5 + 0.5 * fraction); };
  const Result<Comparison> of_second = judgeCalibration(second, half);
  if (control.stop.stop_requested()) return comparisonStopped();
  const MethodScore* second_score = of_second ? scoreOf(*of_second, second) : nullptr;
  difference.first_own = ownErrors(of_first ? scoreOf(*of_first, first) : nullptr);
  difference.second_own = ownErrors(second_score);
  if (second_score) measureAtPlaces(first, second, *second_score, *of_second, difference);
  difference.verdict = verdictOn(difference);
  if (difference.verdict == DifferenceVerdict::kNotShown) difference.unseen_mm = unseen_mm(difference);
  difference.text = sentences(difference);
  return difference;
}

nlohmann::json toJson(const CalibrationDifference& difference) {
  const ChangeAt& worst = difference.points[difference.worst];
  const auto& paired = difference.first_less_second_mm;
  return {
      {"schema", "fieldtrue.difference/1"},
      {"software", std::string("Fieldtrue ") + FIELDTRUE_VERSION},
      {"verdict", nameOf(difference.verdict)},
      {"unseen_mm", orNull(difference.unseen_mm)},
      {"text", difference.text},
      {"setup_matches", fieldtrue::nameOf(difference.setup_matches)},
      {"setup_differences", setupDifferencesToJson(difference.first_setup, difference.second_setup)},
      {"common_points", difference.n_points},
      {"orientations", difference.n_orientations},
      {"orientations_of", orientationsOf(difference)},
      {"whole", {{"rms_mm", difference.whole_rms_mm}, {"max_mm", difference.whole_max_mm}}},
      {"rigid", {{"moved_mm", difference.moved_mm}, {"turned_deg", difference.turned_deg}}},
      {"field",
       {{"rms_mm", difference.rms_mm},
        {"p95_mm", difference.p95_mm},
        {"max_mm", difference.max_mm},
        {"max_at_m", jsonOf(worst.reference_m)},
        {"max_at_wxyz", worst.held ? jsonOf(*worst.held) : nlohmann::json(nullptr)},
        {"max_change_mm", jsonOf(Eigen::Vector3d(kMmPerM * worst.change_m))},
        {"expected_mm", orNull(difference.expected_mm)}}},
      {"orientation",
       {{"rms_deg", orNull(difference.angle_rms_deg)},
        {"max_deg", orNull(difference.angle_max_deg)},
        {"shared_deg", orNull(difference.angle_shared_deg)}}},
      {"first_held_out", toJson(difference.first_own)},
      {"second_held_out", toJson(difference.second_own)},
      {"first_at_second", toJson(difference.first_at_second)},
      {"worst_place", nullUnlessTold(difference.worst_place)},
      {"worst_place_m", difference.worst_place.empty() ? nlohmann::json(nullptr) : jsonOf(difference.worst_place_m)},
      {"places_beyond", difference.n_beyond},
      {"places_far_beyond", difference.n_far},
      {"first_less_second_mm",
       paired ? nlohmann::json{{"difference", paired->difference}, {"low90", paired->low90}, {"high90", paired->high90}}
              : nlohmann::json(nullptr)}};
}

}  // namespace fieldtrue::evaluation
