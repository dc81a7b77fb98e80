#include "widgets/views/room/room_parts.h"

#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>

#include "widgets/views/host/mesh.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kTrailLength = 60;
constexpr double kLeastStep_m = 1e-5;

QColor between(const QColor& a, const QColor& b, double share_of_b) {
  const auto mix = [share_of_b](int x, int y) { return static_cast<int>(std::lround(x + share_of_b * (y - x))); };
  return QColor(mix(a.red(), b.red()), mix(a.green(), b.green()), mix(a.blue(), b.blue()));
}

void paint(vtkActor* actor, const QColor& color, double width_px = 1.0) {
  actor->GetProperty()->SetColor(rgb(color).data());
  actor->GetProperty()->SetLineWidth(static_cast<float>(width_px));
}

Lines floorGrid(const SceneSpace& space) {
  Lines lines;
  for (int axis = 0; axis < 2; ++axis) {
    const int other = 1 - axis;
    const double pitch = space.pitch_m[axis], origin = space.grid_origin_m[axis];
    const int first = static_cast<int>(std::ceil((space.low_m[axis] - origin) / pitch - 1e-6));
    for (int k = first; origin + k * pitch <= space.high_m[axis] + 1e-6; ++k) {
      Eigen::Vector3d from = space.low_m, to = space.low_m;
      from[axis] = to[axis] = origin + k * pitch;
      to[other] = space.high_m[other];
      lines.add(from, to);
    }
  }
  return lines;
}

Lines boxEdges(const SceneSpace& space) {
  Lines lines;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if (corner & (1 << axis)) continue;
      Eigen::Vector3d from = space.low_m;
      for (int k = 0; k < 3; ++k)
        if (corner & (1 << k)) from[k] = space.high_m[k];
      Eigen::Vector3d to = from;
      to[axis] = space.high_m[axis];
      lines.add(from, to);
    }
  }
  return lines;
}

void addAxes(Mesh& mesh, const Pose& pose, double length_m, double radius_m, const Theme& theme) {
  for (int axis = 0; axis < 3; ++axis) {
    mesh.setColor(axisColor(axis, theme));
    mesh.addArrow(pose.position_m, pose * Eigen::Vector3d(length_m * Eigen::Vector3d::Unit(axis)), radius_m);
  }
}

}  // namespace

QColor axisColor(int axis, const Theme& theme) {
  // Three colours of Okabe and Ito's set that stay apart for the colour-blind, lighter on a dark ground.
  if (axis == 0) return theme.dark ? QColor(0xff, 0x8a, 0x4c) : QColor(0xd5, 0x5e, 0x00);
  if (axis == 1) return theme.dark ? QColor(0x3f, 0xd0, 0xa4) : QColor(0x00, 0x9e, 0x73);
  return theme.dark ? QColor(0x6c, 0xb8, 0xff) : QColor(0x00, 0x72, 0xb2);
}

RoomBox::RoomBox(vtkRenderer* renderer)
    : floor_(addFlatActor(renderer)), grid_(addFlatActor(renderer)), edges_(addFlatActor(renderer)) {}

void RoomBox::build(const SceneSpace& space, const Theme& theme, double ratio) {
  Mesh floor;
  const double z = space.low_m.z() - 0.002 * space.diagonal_m();
  const auto corner = [&](bool far_x, bool far_y) {
    return Eigen::Vector3d((far_x ? space.high_m : space.low_m).x(), (far_y ? space.high_m : space.low_m).y(), z);
  };
  floor.addTriangle(corner(false, false), corner(true, false), corner(true, true), Eigen::Vector3d::UnitZ());
  floor.addTriangle(corner(false, false), corner(true, true), corner(false, true), Eigen::Vector3d::UnitZ());
  setShape(floor_, floor.polyData());
  setShape(grid_, floorGrid(space).polyData());
  setShape(edges_, boxEdges(space).polyData());
  paint(floor_, theme.surface);
  paint(grid_, theme.line, ratio);
  paint(edges_, theme.line, 1.2 * ratio);
}

TransmitterPart::TransmitterPart(vtkRenderer* renderer) : actor_(addSolidActor(renderer)) {}

void TransmitterPart::build(const Pose& reference_from_tracker, const SceneSpace& space, const Theme& theme) {
  const double size =
      std::clamp(0.32 * space.pitch_m.minCoeff(), 0.012 * space.diagonal_m(), 0.05 * space.diagonal_m());
  Mesh mesh;
  mesh.setColor(theme.dark ? QColor(0x8a, 0x97, 0xa4) : QColor(0x4a, 0x55, 0x60));
  mesh.addBox(reference_from_tracker, Eigen::Vector3d::Constant(0.5 * size));
  addAxes(mesh, reference_from_tracker, 2.0 * size, 0.07 * size, theme);
  setShape(actor_, mesh.polyData());
  labels_.clear();
  for (int axis = 0; axis < 3; ++axis)
    labels_.push_back({reference_from_tracker * Eigen::Vector3d(2.3 * size * Eigen::Vector3d::Unit(axis)),
                       std::string(1, "xyz"[axis]), axisColor(axis, theme)});
  labels_.push_back({reference_from_tracker.position_m, "transmitter", theme.text, 1.3 * size});
}

JigPart::JigPart(vtkRenderer* renderer) : actor_(addSolidActor(renderer)) {}

void JigPart::build(const std::optional<Pose>& reference_from_sensor, const SceneSpace& space, const Theme& theme) {
  Mesh mesh;
  if (reference_from_sensor) {
    const double pitch = space.pitch_m.minCoeff();
    const Eigen::Vector3d place = reference_from_sensor->position_m;
    const double floor = std::min(space.low_m.z(), place.z() - 0.05 * pitch);
    const double thickness = 0.06 * pitch;
    Pose base;
    base.position_m = Eigen::Vector3d(place.x(), place.y(), floor + 0.5 * thickness);
    mesh.setColor(theme.dark ? QColor(0xb5, 0x86, 0x4f) : QColor(0xc7, 0x94, 0x58));
    mesh.addBox(base, Eigen::Vector3d(0.38 * pitch, 0.38 * pitch, 0.5 * thickness));
    mesh.setColor(theme.dark ? QColor(0xc3, 0xcd, 0xd6) : QColor(0xb4, 0xbe, 0xc8));
    mesh.addCylinder(base.position_m, place, 0.035 * pitch);
    mesh.setColor(theme.accent);
    const Pose& head = *reference_from_sensor;
    mesh.addBox(head, Eigen::Vector3d(0.07, 0.05, 0.04) * pitch);
  }
  setShape(actor_, mesh.polyData());
}

SensorPart::SensorPart(vtkRenderer* renderer) : axes_(addSolidActor(renderer)), trail_(addFlatActor(renderer)) {}

void SensorPart::add(const std::optional<Pose>& reference_from_sensor) {
  pose_ = reference_from_sensor;
  if (!pose_) return trail_m_.clear();
  trail_m_.push_back(pose_->position_m);
  if (trail_m_.size() > kTrailLength) trail_m_.pop_front();
}

void SensorPart::build(const SceneSpace& space, const Theme& theme) {
  Mesh mesh;
  const double length = 0.34 * space.pitch_m.minCoeff();
  if (pose_) addAxes(mesh, *pose_, length, 0.055 * length, theme);
  setShape(axes_, mesh.polyData());

  Mesh trail;
  for (std::size_t k = 1; k < trail_m_.size(); ++k) {
    if ((trail_m_[k] - trail_m_[k - 1]).norm() < kLeastStep_m) continue;
    const double age = static_cast<double>(trail_m_.size() - k) / static_cast<double>(kTrailLength);
    trail.setColor(between(theme.text, theme.background, 0.85 * age));
    trail.addCylinder(trail_m_[k - 1], trail_m_[k], (1.0 - 0.7 * age) * 0.04 * length, 6);
  }
  setShape(trail_, trail.polyData());
}

PathPart::PathPart(vtkRenderer* renderer) : actor_(addFlatActor(renderer)) {}

void PathPart::build(const std::optional<Eigen::Vector3d>& from_m, const std::optional<Eigen::Vector3d>& to_m,
                     const SceneSpace& space, const Theme& theme) {
  Mesh mesh;
  const double pitch = space.pitch_m.minCoeff();
  const double clear = 2.2 * space.mark_radius_m;
  if (from_m && to_m && (*to_m - *from_m).norm() > 2.5 * clear) {
    const Eigen::Vector3d along = (*to_m - *from_m).normalized();
    const double end = (*to_m - *from_m).norm() - clear;
    const double head = 0.16 * pitch, dash = 0.09 * pitch;
    mesh.setColor(theme.accent);
    for (double at = 0.6 * clear; at < end - head; at += 1.8 * dash)
      mesh.addCylinder(*from_m + at * along, *from_m + std::min(at + dash, end - head) * along, 0.018 * pitch, 10);
    mesh.addCone(*from_m + (end - head) * along, *from_m + end * along, 0.06 * pitch);
  }
  setShape(actor_, mesh.polyData());
}

}  // namespace fieldtrue::widgets
