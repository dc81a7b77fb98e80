#pragma once

#include <vtkSmartPointer.h>

#include <deque>
#include <optional>

#include "calib/core/pose.h"
#include "widgets/figures/scene_space.h"
#include "widgets/views/host/overlay.h"

class vtkActor;
class vtkRenderer;

namespace fieldtrue::widgets {

/// Colours of the axes x, y, z wherever a frame is drawn; told apart by their letters too.
QColor axisColor(int axis, const Theme& theme);

/// Floor with grid lines at the pitch, and the edges of the room.
class RoomBox {
 public:
  explicit RoomBox(vtkRenderer* renderer);
  void build(const SceneSpace& space, const Theme& theme, double ratio);

 private:
  vtkSmartPointer<vtkActor> floor_, grid_, edges_;
};

/// The transmitter with its axes.
class TransmitterPart {
 public:
  explicit TransmitterPart(vtkRenderer* renderer);
  void build(const Pose& reference_from_tracker, const SceneSpace& space, const Theme& theme);
  /// Its name and its axes' letters.
  std::vector<SceneLabel> labels() const { return labels_; }

 private:
  vtkSmartPointer<vtkActor> actor_;
  std::vector<SceneLabel> labels_;
};

/// The jig as it should stand: wooden base on the floor, pipe up to the place.
class JigPart {
 public:
  explicit JigPart(vtkRenderer* renderer);
  void build(const std::optional<Pose>& reference_from_sensor, const SceneSpace& space, const Theme& theme);

 private:
  vtkSmartPointer<vtkActor> actor_;
};

/// The live sensor as a small frame of axes with a short trail.
class SensorPart {
 public:
  explicit SensorPart(vtkRenderer* renderer);
  void add(const std::optional<Pose>& reference_from_sensor);
  void build(const SceneSpace& space, const Theme& theme);

 private:
  std::optional<Pose> pose_;
  std::deque<Eigen::Vector3d> trail_m_;
  vtkSmartPointer<vtkActor> axes_, trail_;
};

/// A dashed way from one place to another.
class PathPart {
 public:
  explicit PathPart(vtkRenderer* renderer);
  void build(const std::optional<Eigen::Vector3d>& from_m, const std::optional<Eigen::Vector3d>& to_m,
             const SceneSpace& space, const Theme& theme);

 private:
  vtkSmartPointer<vtkActor> actor_;
};

}  // namespace fieldtrue::widgets
