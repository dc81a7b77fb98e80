#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "widgets/figures/scene_space.h"

class vtkCamera;

namespace fieldtrue::widgets {

/// Views an operator knows: from behind the own side, straight from the front, the side and the top (north, +y, up).
enum class CameraPreset { kOperator, kFront, kSide, kTop };

/// An upright camera as the five things a person changes.
struct CameraPose {
  Eigen::Vector3d focus_m = Eigen::Vector3d::Zero();
  double azimuth_rad = 0.0;      ///< Of the camera seen from the focus, about +z from +x.
  double elevation_rad = 0.5;    ///< Of the camera above the horizontal plane, within +-90 degrees.
  double view_height_m = 1.0;    ///< Height of what is seen in the focal plane.
  double view_angle_rad = 0.45;  ///< Narrow looks parallel.
  Eigen::Vector2d window_center = Eigen::Vector2d::Zero();  ///< Of the picture against the focus, in half pictures.
  bool operator==(const CameraPose&) const = default;
};

/// A view's size and what text and legends take of it at each side, in one unit.
struct ViewFrame {
  double width = 1.0, height = 1.0;
  double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
};

/// The preset that shows all of a space in the free part of a view.
CameraPose presetPose(CameraPreset preset, const SceneSpace& space, const ViewFrame& frame);

/// Between two poses, turning the short way. @param t 0 gives a, 1 gives b
CameraPose interpolate(const CameraPose& a, const CameraPose& b, double t);

void apply(const CameraPose& pose, vtkCamera* camera);

/// The pose of a camera set by apply().
CameraPose poseOf(vtkCamera* camera);

}  // namespace fieldtrue::widgets
