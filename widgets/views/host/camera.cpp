#include "widgets/views/host/camera.h"

#include <vtkCamera.h>

#include <algorithm>
#include <cmath>

#include "calib/core/units.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kPerspective_rad = 28.0 * kPi / 180.0;
constexpr double kNearlyParallel_rad = 5.0 * kPi / 180.0;
constexpr double kOperatorTurn_rad = 24.0 * kPi / 180.0;
constexpr double kOperatorElevation_rad = 22.0 * kPi / 180.0;
constexpr double kLeastFree = 0.6;  ///< Half pictures kept for the scene in a view too small for its legends.

struct Directions {
  Eigen::Vector3d toward_camera, up, right;
};

Directions directions(const CameraPose& pose) {
  const double ca = std::cos(pose.azimuth_rad), sa = std::sin(pose.azimuth_rad);
  const double ce = std::cos(pose.elevation_rad), se = std::sin(pose.elevation_rad);
  Directions d;
  d.toward_camera = Eigen::Vector3d(ce * ca, ce * sa, se);
  d.up = Eigen::Vector3d(-se * ca, -se * sa, ce);
  d.right = d.up.cross(d.toward_camera);
  return d;
}

/// Azimuth of the side on which the operator stands: across the places from the transmitter.
double operatorAzimuth_rad(const SceneSpace& space) {
  const Eigen::Vector2d across = (space.center_m() - space.transmitter_m).head<2>();
  return across.norm() < 0.05 * space.diagonal_m() ? 0.0 : std::atan2(across.y(), across.x());
}

Eigen::Vector3d corner(const SceneSpace& space, int number) {
  return {(number & 1 ? space.high_m : space.low_m).x(), (number & 2 ? space.high_m : space.low_m).y(),
          (number & 4 ? space.high_m : space.low_m).z()};
}

/// Where the corners of a space fall in half pictures from the focus, for a camera at a distance.
Eigen::AlignedBox2d seen(const CameraPose& pose, const SceneSpace& space, double aspect, double distance_m) {
  const Directions d = directions(pose);
  const double slope = std::tan(0.5 * pose.view_angle_rad);
  Eigen::AlignedBox2d box;
  for (int number = 0; number < 8; ++number) {
    const Eigen::Vector3d from_focus = corner(space, number) - pose.focus_m;
    const double depth = std::max(distance_m - from_focus.dot(d.toward_camera), 0.05 * distance_m);
    box.extend(Eigen::Vector2d(from_focus.dot(d.right) / aspect, from_focus.dot(d.up)) / (depth * slope));
  }
  return box;
}

void fit(CameraPose& pose, const SceneSpace& space, const ViewFrame& frame) {
  constexpr int kSteps = 12;  // the size on screen is nearly proportional to 1 / distance: converges in a few
  const double aspect = frame.width / frame.height;
  const Eigen::Vector2d free(std::max(2.0 * (1.0 - (frame.left + frame.right) / frame.width), kLeastFree),
                             std::max(2.0 * (1.0 - (frame.top + frame.bottom) / frame.height), kLeastFree));
  double distance_m = space.diagonal_m() / std::tan(0.5 * pose.view_angle_rad);
  for (int step = 0; step < kSteps; ++step)
    distance_m *= seen(pose, space, aspect, distance_m).sizes().cwiseQuotient(free).maxCoeff();
  pose.view_height_m = 2.0 * distance_m * std::tan(0.5 * pose.view_angle_rad);
  const Eigen::Vector2d free_center((frame.left - frame.right) / frame.width,
                                    (frame.bottom - frame.top) / frame.height);
  pose.window_center = seen(pose, space, aspect, distance_m).center() - free_center;
}

double shortTurn_rad(double from, double to) { return std::remainder(to - from, 2.0 * kPi); }

}  // namespace

CameraPose presetPose(CameraPreset preset, const SceneSpace& space, const ViewFrame& frame) {
  CameraPose pose;
  pose.focus_m = space.center_m();
  pose.view_angle_rad = kNearlyParallel_rad;
  const double front_rad = std::round(operatorAzimuth_rad(space) / (0.5 * kPi)) * 0.5 * kPi;
  switch (preset) {
    case CameraPreset::kOperator:
      pose.azimuth_rad = operatorAzimuth_rad(space) - kOperatorTurn_rad;
      pose.elevation_rad = kOperatorElevation_rad;
      pose.view_angle_rad = kPerspective_rad;
      break;
    case CameraPreset::kFront:
      pose.azimuth_rad = front_rad;
      pose.elevation_rad = 0.0;
      break;
    case CameraPreset::kSide:
      pose.azimuth_rad = front_rad - 0.5 * kPi;
      pose.elevation_rad = 0.0;
      break;
    case CameraPreset::kTop:
      pose.azimuth_rad = -0.5 * kPi;
      pose.elevation_rad = 0.5 * kPi;
      break;
  }
  fit(pose, space, frame);
  return pose;
}

CameraPose interpolate(const CameraPose& a, const CameraPose& b, double t) {
  CameraPose between;
  between.focus_m = a.focus_m + t * (b.focus_m - a.focus_m);
  between.azimuth_rad = a.azimuth_rad + t * shortTurn_rad(a.azimuth_rad, b.azimuth_rad);
  between.elevation_rad = a.elevation_rad + t * (b.elevation_rad - a.elevation_rad);
  between.view_height_m = a.view_height_m * std::pow(b.view_height_m / a.view_height_m, t);
  between.view_angle_rad = a.view_angle_rad + t * (b.view_angle_rad - a.view_angle_rad);
  between.window_center = a.window_center + t * (b.window_center - a.window_center);
  return between;
}

void apply(const CameraPose& pose, vtkCamera* camera) {
  const Directions d = directions(pose);
  const double distance = 0.5 * pose.view_height_m / std::tan(0.5 * pose.view_angle_rad);
  const Eigen::Vector3d position = pose.focus_m + distance * d.toward_camera;
  camera->SetFocalPoint(pose.focus_m.data());
  camera->SetPosition(position.data());
  camera->SetViewUp(d.up.data());
  camera->SetWindowCenter(pose.window_center.x(), pose.window_center.y());
  camera->SetViewAngle(pose.view_angle_rad * 180.0 / kPi);
}

CameraPose poseOf(vtkCamera* camera) {
  CameraPose pose;
  pose.focus_m = Eigen::Vector3d(camera->GetFocalPoint());
  const Eigen::Vector3d offset = Eigen::Vector3d(camera->GetPosition()) - pose.focus_m;
  const Eigen::Vector3d toward = offset.normalized();
  const Eigen::Vector3d up(camera->GetViewUp());
  pose.elevation_rad = std::asin(std::clamp(toward.z(), -1.0, 1.0));
  // Seen from straight above or below, only the up direction still tells the azimuth.
  const Eigen::Vector3d horizontal =
      std::abs(toward.z()) < 0.7 ? toward : Eigen::Vector3d(-std::copysign(1.0, toward.z()) * up);
  pose.azimuth_rad = std::atan2(horizontal.y(), horizontal.x());
  pose.view_angle_rad = camera->GetViewAngle() * kPi / 180.0;
  pose.view_height_m = 2.0 * offset.norm() * std::tan(0.5 * pose.view_angle_rad);
  pose.window_center = Eigen::Vector2d(camera->GetWindowCenter());
  return pose;
}

}  // namespace fieldtrue::widgets
