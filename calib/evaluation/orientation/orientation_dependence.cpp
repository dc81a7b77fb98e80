#include "calib/evaluation/orientation/orientation_dependence.h"

#include <nlohmann/json.hpp>

#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/orientation/orientation_models.h"
#include "calib/evaluation/orientation/orientation_neighbours.h"
#include "calib/evaluation/orientation/orientation_rows.h"

namespace fieldtrue::evaluation {
namespace {

using Answer = OrientationDependence::Answer;

constexpr int kFewestPlaces = 20;
constexpr std::size_t kFewestOrientations = 3;
/// Below so many orientations none can be held out: the others do not tell how the error goes on between them.
constexpr std::size_t kEnoughToHoldOut = 6;
/// A dependence that takes less than this off the error does not matter.
constexpr double kMatters = 0.10;

void judge(const NestedErrors& errors, OrientationDependence& dependence) {
  if (errors.place_only.size() < 3) return;
  const PairedGain gain = pairedGain(errors.place_only, errors.with_orientation);
  dependence.place_only = rootMeanSquare(errors.place_only);
  dependence.with_orientation = rootMeanSquare(errors.with_orientation);
  dependence.gain_low90 = gain.low90;
  dependence.gain_high90 = gain.high90;
  dependence.answer = gain.low90 > 0.0 ? Answer::kYes : gain.high90 < kMatters ? Answer::kNo : Answer::kCannotTell;
}

const char* errorName(PosePart part) { return part == PosePart::kPosition ? "position error" : "orientation error"; }

std::string figuresText(const OrientationDependence& dependence) {
  return errorText(dependence.place_only) + " " + unitOf(dependence.part) +
         " are left by a function of the place alone, " + errorText(dependence.with_orientation) +
         " with the orientation (held out; 90 % interval of the gain " + percentText(dependence.gain_low90) + " to " +
         percentText(dependence.gain_high90) + " %)";
}

std::string answerText(const OrientationDependence& dependence) {
  const std::string error = errorName(dependence.part);
  switch (dependence.answer) {
    case Answer::kYes:
      return "The " + error + " depends on how the sensor is held as well as on the place: " + figuresText(dependence);
    case Answer::kNo:
      return "The " + error +
             " does not depend on how the sensor is held, only on the place: " + figuresText(dependence);
    case Answer::kCannotTell:
      break;
  }
  return "Whether the " + error +
         " depends on how the sensor is held cannot be told from these places: " + figuresText(dependence);
}

std::string tooFewText(const OrientationRows& rows, PosePart part, int n_places) {
  return "Whether the " + std::string(errorName(part)) +
         " depends on how the sensor is held cannot be told: it needs at least 3 orientations at 20 places, and there "
         "are " +
         countText(static_cast<std::size_t>(n_places), "place", "places") + " with 3 or more (" +
         (rows.has_more_groups ? "at least " : "") + countText(rows.n_groups, "orientation", "orientations") +
         " in all at " + countText(rows.n_places, "place", "places") + ").";
}

}  // namespace

Result<OrientationDependence> orientationDependence(const CalibrationTable& table, PosePart part, std::uint64_t seed,
                                                    const RunControl& control) {
  FT_TRY(const auto rows, orientationRows(table, part));
  OrientationDependence dependence;
  dependence.part = part;
  dependence.n_places = placesWithThreeOrientations(rows);
  const bool has_visits = dependence.n_places >= kFewestPlaces;
  const bool has_neighbours =
      rows.n_groups >= kFewestOrientations && rows.n_places >= static_cast<std::size_t>(kFewestPlaces);
  if (!has_visits && !has_neighbours) {
    dependence.text = tooFewText(rows, part, dependence.n_places);
    return dependence;
  }
  dependence.by_neighbours = !has_visits;
  const bool hold_out_orientations = rows.n_groups >= kEnoughToHoldOut;
  const NestedErrors errors =
      has_visits ? nestedModelErrors(rows, part, hold_out_orientations, seed, control) : neighbourErrors(rows, seed);
  if (control.stop.stop_requested()) return comparisonStopped();
  judge(errors, dependence);
  dependence.text = answerText(dependence);
  if (dependence.by_neighbours)
    dependence.text += ", judged by neighbours in position and orientation, which is weaker than visits of one place";
  else if (!hold_out_orientations)
    dependence.text += "; with " + countText(rows.n_groups, "orientation", "orientations") +
                       " only places were held out, and a fixture that holds one of them wrong would look the same";
  dependence.text += ".";
  return dependence;
}

nlohmann::json toJson(const OrientationDependence& dependence) {
  const char* answer = dependence.answer == Answer::kYes  ? "yes"
                       : dependence.answer == Answer::kNo ? "no"
                                                          : "cannot tell";
  const bool judged = dependence.place_only > 0.0;
  const auto number = [&](double value) { return judged ? nlohmann::json(value) : nlohmann::json(nullptr); };
  const std::string unit = dependence.part == PosePart::kPosition ? "_mm" : "_deg";
  return {{"answer", answer},
          {"by_neighbours", dependence.by_neighbours},
          {"places", dependence.n_places},
          {"place_only" + unit, number(dependence.place_only)},
          {"with_orientation" + unit, number(dependence.with_orientation)},
          {"gain_low90", number(dependence.gain_low90)},
          {"gain_high90", number(dependence.gain_high90)},
          {"text", dependence.text}};
}

}  // namespace fieldtrue::evaluation
