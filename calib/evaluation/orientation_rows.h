#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"

namespace fieldtrue {

/// The rows of a table as the question needs them: where, how turned, how wrong.
struct OrientationRows {
  std::vector<int> node;
  std::vector<std::size_t> place;            ///< Number of the row's place, 0 and up.
  std::vector<Eigen::Vector3d> p_tracked_m;  ///< Tracker frame.
  std::vector<Eigen::Quaterniond> q_true;    ///< Tracker frame, mounting taken off.
  std::vector<Eigen::Vector3d> error_deg;    ///< Rotation vector of q_tracked q_true^-1, tracker frame.
  std::vector<std::size_t> group;            ///< Of orientations that are alike.
  std::size_t n_places = 0;
  std::size_t n_groups = 0;
  int dimension = 3;  ///< Of the true positions.

  std::size_t size() const { return node.size(); }
};

/// Rows of places that count, with the rigid part taken off unless the alignment is known.
/// @error kUnsupported when a row has no orientation; kTooFewNodes, kDegenerate as fitAlignment
Result<OrientationRows> orientationRows(const CalibrationTable& table);

/// Number of places at which the sensor was held in at least three orientations, more than 10 degrees apart.
int placesWithThreeOrientations(const OrientationRows& rows);

/// Errors of the held-out rows, by place, of a model without and with terms in the orientation.
struct NestedErrors {
  std::vector<double> place_only_deg;
  std::vector<double> with_orientation_deg;
};

/// Within each place the mean error is free (any function of the place); the larger model adds functions of the true
/// orientation up to degree 2, held back by a ridge that is chosen inside the training rows and may be infinite.
/// @param hold_out_orientations leaves out whole orientations too: rows are scored by fits that saw neither their place
///        nor their orientation
NestedErrors nestedModelErrors(const OrientationRows& rows, bool hold_out_orientations, std::uint64_t seed,
                               const RunControl& control);

/// What the nearest other places tell about each row, near in position, or in position and orientation. The scale
/// between the two is chosen on the other half of the places.
NestedErrors neighbourErrors(const OrientationRows& rows, std::uint64_t seed);

}  // namespace fieldtrue
