#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/evaluation/orientation/orientation_cover.h"

namespace fieldtrue::evaluation {

/// What the orientations of a plan will tell about a correction that takes orientation as an input, before anything is
/// measured.
struct PlannedOrientations {
  OrientationCover cover;
  /// Ways in which the gains and angles of three coils can differ: five, since a gain of all alike is a scale.
  static constexpr int kCoilWays = 5;
  int coil_ways_told = 0;  ///< Of these, by the changes from one orientation to the next at the same place.
  /// SD of the one of them that is told worst, as a strain of unit norm (0.01: coils about 1 % apart); none where none
  /// is told.
  std::optional<double> coil_sd;
  std::vector<int> turn_here;  ///< Places at which to turn the sensor too, those that help most first.
  std::string text;            ///< What it amounts to, and what to do.
};

/// Of a wooden jig whose tolerance nobody stated, each axis.
inline constexpr double kUsualPlacing_m = 2e-3;

/// @param placing_sd_m of each visit, each axis; above 0
PlannedOrientations plannedOrientations(std::span<const PlannedPlace> plan, const Pose& tracker_from_reference,
                                        double placing_sd_m = kUsualPlacing_m);

nlohmann::json toJson(const PlannedOrientations& planned);

}  // namespace fieldtrue::evaluation
