#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/orientation/orientation_rows.h"

namespace fieldtrue::evaluation {

/// Whether an error depends on the sensor's orientation as well as on its place: the position error, or the orientation
/// error.
/// @source the question is the survey's (Kindratenko, section 4, about Livingston and State 1997)
struct OrientationDependence {
  enum class Answer { kYes, kNo, kCannotTell };
  PosePart part = PosePart::kOrientation;
  Answer answer = Answer::kCannotTell;
  bool by_neighbours = false;     ///< Single-visit table: neighbours in position and orientation; weaker.
  int n_places = 0;               ///< With at least three orientations.
  double place_only = 0.0;        ///< Held-out RMS of the smaller model, error a function of the place; unitOf(part).
  double with_orientation = 0.0;  ///< Held-out RMS of the larger model; likewise.
  double gain_low90 = 0.0;        ///< Paired 90 % interval of 1 - larger / smaller.
  double gain_high90 = 0.0;
  std::string text;  ///< One sentence.
};

/// @error kUnsupported without orientations
Result<OrientationDependence> orientationDependence(const CalibrationTable& table, PosePart part,
                                                    std::uint64_t seed = 1, const RunControl& control = {});

nlohmann::json toJson(const OrientationDependence& dependence);

}  // namespace fieldtrue::evaluation
