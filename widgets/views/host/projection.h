#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

class vtkRenderer;

namespace fieldtrue::widgets {

/// Where points of the scene fall in the picture, for the camera of the moment.
class Projection {
 public:
  explicit Projection(vtkRenderer* renderer);
  /// Device pixels from the lower left corner, and the depth from 0 (near) to 1; none behind the camera.
  std::optional<Eigen::Vector3d> toPixels(const Eigen::Vector3d& point_m) const;

 private:
  Eigen::Matrix4d clip_from_world_;
  Eigen::Vector2d size_px_;
  double near_m_, far_m_;
};

/// Rotation of the camera of the moment: columns right, up, toward the camera.
Eigen::Matrix3d worldFromView(vtkRenderer* renderer);

}  // namespace fieldtrue::widgets
