#pragma once

#include <QMargins>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "calib/core/calibration_table.h"
#include "widgets/style/units.h"
#include "widgets/views/room/room_parts.h"

namespace fieldtrue::widgets {

/// What RoomView and renderPicture draw. Setters only note the change; update() does the work before a frame.
class RoomScene {
 public:
  explicit RoomScene(vtkRenderer* renderer);

  void setPlaces(const std::vector<PlannedPlace>& places);
  void setStates(const std::vector<acquisition::PlaceState>& states, std::optional<std::size_t> current);
  void setTransmitter(const Pose& reference_from_tracker);
  /// Draws the transmitter elsewhere and leaves the room as it is.
  void moveTransmitter(const Pose& reference_from_tracker);
  void setLive(const std::optional<Pose>& reference_from_sensor);
  void setJig(const std::optional<Pose>& reference_from_sensor);
  void setSelected(std::optional<int> place);
  void setHovered(std::optional<int> place);
  void setUnit(LengthUnit unit);
  void setFloor(std::optional<double> floor_z_m);
  void setStyle(const Theme& theme, double ratio);
  /// @param phase of the next place's pulse, from 0 to 1
  void setPulse(double phase);

  const SceneSpace& space() const { return space_; }
  const std::vector<PlannedPlace>& places() const { return places_; }
  bool hasCurrent() const { return current_.has_value(); }

  /// What axis labels and legends take of the picture at each side [logical pixels].
  static QMargins legendMargins();

  void update();
  /// Turns the marks to the camera of the moment.
  void faceCamera();

 private:
  enum Layer {
    kPlanned,
    kPlannedValidation,
    kDone,
    kDoneValidation,
    kSuspicious,
    kSkipped,
    kNext,
    kNextCore,
    kPulse,
    kHalo
  };
  void updateSpace();
  void updateMarks();
  void updateRoom();
  void updateOverlay();
  Layer layerOf(std::size_t place) const;
  std::optional<Eigen::Vector3d> lastPlace_m() const;

  vtkRenderer* renderer_;
  RoomBox box_;
  TransmitterPart transmitter_part_;
  JigPart jig_part_;
  PathPart path_;
  SensorPart sensor_;
  std::map<Layer, MarkLayer> marks_;
  vtkSmartPointer<Overlay> overlay_;

  std::vector<PlannedPlace> places_;
  std::vector<acquisition::PlaceState> states_;
  std::optional<std::size_t> current_;
  std::optional<int> selected_, hovered_;
  std::optional<Pose> jig_;
  std::optional<double> floor_z_m_;
  Pose reference_from_tracker_;
  SceneSpace space_;
  const Theme* theme_ = &Theme::of(false);
  double ratio_ = 1.0;
  double pulse_ = 0.0;
  bool room_changed_ = true, marks_changed_ = true, live_changed_ = true;
};

}  // namespace fieldtrue::widgets
