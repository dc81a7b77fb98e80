#include "widgets/views/host/projection.h"

#include <vtkCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkRenderer.h>

#include <algorithm>

namespace fieldtrue::widgets {

Projection::Projection(vtkRenderer* renderer) {
  vtkCamera* camera = renderer->GetActiveCamera();
  const vtkMatrix4x4* matrix =
      camera->GetCompositeProjectionTransformMatrix(renderer->GetTiledAspectRatio(), -1.0, 1.0);
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) clip_from_world_(row, column) = matrix->GetElement(row, column);
  const int* size = renderer->GetSize();
  size_px_ = Eigen::Vector2d(size[0], size[1]);
  near_m_ = camera->GetClippingRange()[0];
  far_m_ = camera->GetClippingRange()[1];
}

std::optional<Eigen::Vector3d> Projection::toPixels(const Eigen::Vector3d& point_m) const {
  const Eigen::Vector4d clip = clip_from_world_ * point_m.homogeneous();
  if (clip.w() <= 0.0) return std::nullopt;
  const Eigen::Vector2d unit = 0.5 * (clip.head<2>() / clip.w() + Eigen::Vector2d::Ones());
  const Eigen::Vector2d px = unit.cwiseProduct(size_px_);
  return Eigen::Vector3d(px.x(), px.y(), std::clamp((clip.w() - near_m_) / (far_m_ - near_m_), 0.0, 1.0));
}

Eigen::Matrix3d worldFromView(vtkRenderer* renderer) {
  vtkCamera* camera = renderer->GetActiveCamera();
  const Eigen::Vector3d toward =
      (Eigen::Vector3d(camera->GetPosition()) - Eigen::Vector3d(camera->GetFocalPoint())).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d(camera->GetViewUp()).cross(toward).normalized();
  Eigen::Matrix3d rotation;
  rotation << right, toward.cross(right), toward;
  return rotation;
}

}  // namespace fieldtrue::widgets
