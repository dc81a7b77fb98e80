#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/core/units.h"

namespace fieldtrue::evaluation {

/// Orientations nearer to each other than this count as one.
inline constexpr double kAlike_rad = 10.0 * kRadPerDeg;

/// Which error is asked about.
enum class PosePart { kPosition, kOrientation };

/// "mm" or "degrees".
const char* unitOf(PosePart part);

/// The rows of a table as the question needs them: where, how turned, how wrong.
struct OrientationRows {
  std::vector<int> node;
  std::vector<std::size_t> place;            ///< Number of the row's place, 0 and up.
  std::vector<Eigen::Vector3d> p_tracked_m;  ///< Tracker frame.
  std::vector<Eigen::Quaterniond> q_true;    ///< Tracker frame, mounting taken off.
  /// Tracker frame, in unitOf() the part asked about: tracked minus true position, or the rotation vector of
  /// q_tracked q_true^-1.
  std::vector<Eigen::Vector3d> error;
  std::vector<std::size_t> group;  ///< Of orientations that are alike.
  std::size_t n_places = 0;
  std::size_t n_groups = 0;
  bool has_more_groups = false;  ///< There are more orientations than are told apart.
  int dimension = 3;             ///< Of the true positions.

  std::size_t size() const { return node.size(); }
};

/// Rows of places that count, of the sensor that has most: sensors differ by their mountings and by their coils, which
/// is not how they are held.
std::vector<Node> nodesOfAskedSensor(const CalibrationTable& table);

/// The asked sensor's rows, with the rigid part taken off unless the alignment is known.
/// @error kUnsupported when a row has no orientation; kTooFewNodes, kDegenerate as fitAlignment
Result<OrientationRows> orientationRows(const CalibrationTable& table, PosePart part);

/// Number of places at which the sensor was held in at least three orientations, more than 10 degrees apart.
int placesWithThreeOrientations(const OrientationRows& rows);

}  // namespace fieldtrue::evaluation
