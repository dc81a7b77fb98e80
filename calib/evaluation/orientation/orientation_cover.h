#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::evaluation {

/// One place and the orientations in which the sensor is held there, one each visit. Any frame, the same for all.
struct TurnedPlace {
  int node = 0;
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  std::vector<Eigen::Quaterniond> q;

  bool isTurned() const;  ///< In two orientations or more.
};

/// What orientations of a sensor places stand for, planned or recorded.
struct OrientationCover {
  int n_orientations = 0;  ///< More than 10 degrees apart.
  int n_places = 0;
  int n_turned = 0;  ///< Places at which the sensor is held in two of them or more.
  /// How far a sensor held anyhow may be from the nearest of them.
  double farthest_deg = 180.0;
  /// Largest distance of a place from one where the sensor is turned [m]; none without any.
  std::optional<double> farthest_turned_m;
  std::string text;  ///< One sentence, of a recording.
};

OrientationCover orientationCover(const std::vector<TurnedPlace>& places);

/// What a table's places stand for, of the sensor with most rows; none where a row of it has no orientation.
std::optional<OrientationCover> orientationCover(const CalibrationTable& table);

nlohmann::json toJson(const OrientationCover& cover);

/// The place that lies farthest from all of some places.
struct FarthestPlace {
  std::size_t place = 0;
  double distance_m = 0.0;
};

FarthestPlace farthestFrom(const std::vector<TurnedPlace>& places, const std::vector<std::size_t>& some);

}  // namespace fieldtrue::evaluation
