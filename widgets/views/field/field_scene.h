#pragma once

#include <QMargins>
#include <memory>
#include <optional>
#include <vector>

#include "widgets/figures/error_field.h"
#include "widgets/style/units.h"
#include "widgets/views/field/volume_parts.h"
#include "widgets/views/room/body_part.h"
#include "widgets/views/room/room_parts.h"

namespace fieldtrue::widgets {

/// What FieldView and renderPicture draw. Setters only note the change; update() does the work before a frame.
class FieldScene {
 public:
  explicit FieldScene(vtkRenderer* renderer);

  void setField(const ErrorField& field);
  void setScaleMax_mm(double scale_max_mm);
  void setMagnification(double magnification);
  void setShowOrientation(bool show);
  void setAngleScaleMax_deg(double scale_max_deg);
  void setSelected(std::optional<int> node);
  void setHovered(std::optional<int> index);
  void setUnit(LengthUnit unit);
  void setVolume(const VolumeField& volume);
  void setSlice(const std::optional<SlicePlane>& plane);
  void setIso(const std::optional<double>& value_mm);
  void setHoles(const std::vector<SceneCell>& holes);
  void setFolds(const std::vector<SceneCell>& cells);
  void setOpacityRange(const std::optional<OpacityRange>& range);
  void setLegendShown(bool shown);
  void setStyle(const Theme& theme, double ratio);

  const SceneSpace& space() const { return space_; }
  const ErrorField& field() const { return field_; }
  /// What hover says of an arrow, one line each: its name, its position error, its orientation error.
  std::vector<std::string> describe(std::size_t index) const;

  /// What axis labels and legends take of the picture at each side [logical pixels].
  static QMargins legendMargins(bool legend_shown = true);
  bool legendShown() const { return legend_shown_; }

  void update();
  /// Turns marks and arcs to the camera of the moment.
  void faceCamera();

 private:
  void updateArrows();
  void updateMarks();
  void updateArcs(const Eigen::Matrix3d& world_from_view);
  void updateVolume();
  void updateOverlay();
  QColor colorOf(const FieldArrow& arrow) const;
  double angleScaleMax_deg() const;
  bool arcsShown() const;

  vtkRenderer* renderer_;
  RoomBox box_;
  TransmitterPart transmitter_part_;
  MarkLayer places_, validation_, flagged_, halo_;
  ArrowLayer arrows_;
  vtkSmartPointer<vtkActor> arcs_;
  HolePart holes_part_;
  SlicePart slice_part_;
  IsoPart iso_part_;
  FoldPart folds_part_;
  BodyPart bodies_part_;
  vtkSmartPointer<Overlay> overlay_;

  ErrorField field_;
  SceneSpace space_;
  double scale_max_mm_ = 10.0;
  double magnification_ = 10.0;
  bool show_orientation_ = false;
  std::optional<double> angle_scale_max_deg_;
  std::optional<int> selected_, hovered_;
  VolumeField volume_;
  std::optional<SlicePlane> slice_;
  std::optional<double> iso_mm_;
  std::vector<SceneCell> holes_, folds_;
  std::optional<OpacityRange> opacity_;
  bool legend_shown_ = true;
  const Theme* theme_ = &Theme::of(false);
  double ratio_ = 1.0;
  bool changed_ = true, volume_changed_ = true, arcs_changed_ = true, overlay_changed_ = true;
  Eigen::Matrix3d arcs_view_ = Eigen::Matrix3d::Zero();
};

}  // namespace fieldtrue::widgets
