#pragma once

#include <array>
#include <optional>
#include <string>

#include "acquisition/protocols/sample_status.h"
#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// A pose as trackers send it, in one of several forms, not yet trusted.
struct PoseNumbers {
  std::optional<Eigen::Vector3d> position_m;                        ///< Tracker frame.
  std::optional<Eigen::Vector3d> euler_deg;                         ///< Azimuth, elevation, roll.
  std::array<std::optional<Eigen::Vector3d>, 3> direction_cosines;  ///< Rows X, Y, Z of the matrix tracker_from_sensor.
  std::optional<Eigen::Vector4d> quaternion_wxyz;                   ///< As sent, not normalised.
};

/// How far the length of a quaternion may be from 1 before it counts as damaged.
inline constexpr double kUnitTolerance = 0.02;

/// The pose as a sample without a time: orientation from the quaternion, else the cosines, else the angles. The status
/// is the one given, or `missing`, or `damaged`; a sample without a usable pose has the identity pose.
/// @param sensor zero-based
/// @param status the tracker's own word on the reading; empty = good
Sample sampleOfNumbers(const PoseNumbers& numbers, int sensor, std::string status,
                       double unit_tolerance = kUnitTolerance);

/// Every form of a pose filled in. @param tracker_from_sensor as the tracker reports it
PoseNumbers numbersOfPose(const Pose& tracker_from_sensor);

}  // namespace fieldtrue::acquisition
