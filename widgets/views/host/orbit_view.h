#pragma once

#include <Eigen/Core>
#include <QMargins>
#include <QPoint>
#include <optional>

#include "widgets/views/host/camera.h"
#include "widgets/views/host/vtk_host.h"

class QVariantAnimation;
class vtkCamera;

namespace fieldtrue::widgets {

/// A 3-D view with an upright camera: drag turns, Shift or the middle button moves, the wheel zooms, a double click or
/// Home shows everything, arrow keys turn, + and - zoom. Points of the scene are found under the mouse.
class OrbitView : public VtkHost {
  Q_OBJECT
 public:
  using Camera = CameraPreset;

  explicit OrbitView(QWidget* parent = nullptr);
  ~OrbitView() override;

  /// Moves to a preset, easing for less than 0.3 s once the view is on screen.
  void setCamera(Camera preset);
  CameraPose cameraPose() const;
  void setCameraPose(const CameraPose& pose);

  /// Both views use one camera from now on (this one's); nullptr gives this view its own again.
  void linkCamera(OrbitView* other);

 protected:
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void resizeGL(int width, int height) override;
  void prepareFrame() override;

  /// The space to show, for presets; changing it does not move a camera the user has placed.
  void setSpace(const SceneSpace& space);
  const SceneSpace& space() const { return space_; }

  /// What legends and labels take of the view at each side [logical pixels].
  virtual QMargins legendMargins() const = 0;

  /// Points that can be hovered and clicked, by index.
  virtual std::vector<Eigen::Vector3d> pickPoints_m() const = 0;
  virtual void pointHovered(std::optional<int> index) = 0;
  virtual void pointClicked(int index) = 0;

 private:
  std::optional<int> pointAt(const QPointF& position) const;
  void observeCamera(const vtkSmartPointer<vtkCamera>& camera);
  void cameraModified();
  ViewFrame frame() const;
  void fitPreset();
  void setHovered(std::optional<int> index);
  void turn(double azimuth_rad, double elevation_rad);
  void move(const QPointF& pixels);
  void zoom(double factor);

  SceneSpace space_;
  Camera preset_ = Camera::kOperator;
  bool placed_by_user_ = false;
  bool follows_ = false;  ///< Another view's camera is used; that view fits it.
  QVariantAnimation* easing_ = nullptr;
  CameraPose ease_from_, ease_to_, drawn_;
  vtkSmartPointer<vtkCamera> camera_;
  unsigned long camera_observer_ = 0;
  std::optional<int> hovered_;
  QPointF press_, last_;
  bool dragged_ = false;
};

}  // namespace fieldtrue::widgets
