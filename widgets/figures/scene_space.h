#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/pose.h"

namespace fieldtrue::widgets {

/// The part of the room a scene shows: box, floor and pitch, reference frame.
struct SceneSpace {
  Eigen::Vector3d low_m{-0.5, -0.5, 0.0};  ///< low_m.z() is the floor.
  Eigen::Vector3d high_m{0.5, 0.5, 1.0};
  Eigen::Vector3d pitch_m{0.25, 0.25, 0.25};
  Eigen::Vector3d grid_origin_m{0.0, 0.0, 0.0};  ///< Grid lines go through it.
  Eigen::Vector3d transmitter_m{0.0, 0.0, 0.0};
  double mark_radius_m = 0.02;  ///< Of a place's mark.
  Eigen::Vector3d center_m() const { return 0.5 * (low_m + high_m); }
  double diagonal_m() const { return (high_m - low_m).norm(); }
};

/// Distance between neighbouring grid coordinates along each axis [m]; scattered points get a round distance instead.
Eigen::Vector3d gridPitch_m(std::span<const Eigen::Vector3d> points_m);

/// The space around places and transmitter.
/// @param floor_m height of the floor [m]; none puts it one vertical pitch below the lowest place
SceneSpace spaceAround(std::span<const Eigen::Vector3d> points_m, const Pose& reference_from_tracker,
                       std::optional<double> floor_m = std::nullopt);

/// 1, 2 or 5 times a power of ten, the nearest at or above `least`.
double roundStep(double least);

}  // namespace fieldtrue::widgets
