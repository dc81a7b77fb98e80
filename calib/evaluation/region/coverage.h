#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::evaluation {

/// A part of the region where no place is near.
struct Hole {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< Reference frame [m].
  double radius_m = 0.0;                               ///< Distance to the nearest place.
};

/// What part of space the places of a table stand for, reference frame.
struct Coverage {
  int n_places = 0;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();  ///< Corners of the bounding box [m].
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
  double volume_m3 = 0.0;      ///< Of the convex hull; 0 in a plane.
  double spacing_m = 0.0;      ///< Median distance from a place to its nearest neighbour.
  double largest_gap_m = 0.0;  ///< Largest distance inside the hull from a place.
  std::vector<Hole>
      holes;  ///< Points inside farther than 1.5 times what a full grid of this spacing leaves; largest first.
  std::vector<int> missing;  ///< Node numbers planned but skipped, where the table lists them.
  Region region;             ///< Reference frame; `outside_m` is the distance of an extrapolation.
  std::string text;          ///< One sentence.
};

Coverage coverageOf(const CalibrationTable& table);

nlohmann::json toJson(const Coverage& coverage);

}  // namespace fieldtrue::evaluation
