#pragma once

#include <vtkSmartPointer.h>

#include <QImage>
#include <QOpenGLWidget>

class vtkGenericOpenGLRenderWindow;
class vtkRenderer;

namespace fieldtrue::widgets {

/// A VTK render window inside a Qt 6 window: one host for 3-D views and charts.
///
/// VTK draws in the widget's own context and never sees an event: views answer mouse and keys in Qt's terms; repaints
/// are asked for with requestRender() and happen once per event loop turn.
class VtkHost : public QOpenGLWidget {
  Q_OBJECT
 public:
  explicit VtkHost(QWidget* parent = nullptr);
  ~VtkHost() override;

  vtkGenericOpenGLRenderWindow* renderWindow() const;
  vtkRenderer* renderer() const;

  /// Repaints soon; any number of calls before that cost one repaint.
  void requestRender();

  /// What the view shows, in device pixels; null while the view was never shown.
  QImage picture();

  /// Device pixels per logical pixel of the screen the view is on.
  double pixelRatio() const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void initializeGL() override;
  void resizeGL(int width, int height) override;
  void paintGL() override;
  bool event(QEvent* event) override;

  /// Called before every frame with the context current: put what follows the camera in its place.
  virtual void prepareFrame() {}

  /// Applies colours and text sizes; called once when the view is first drawn, on a theme change and on a new pixel
  /// ratio.
  virtual void restyle(double pixel_ratio);

  /// Whether frames take the time for smooth edges: always with a graphics processor, without one only if
  /// `in_software`.
  void setSmooth(bool in_software);

 private:
  void releaseGl();
  void updateSmoothness();
  void blitToWidget();
  void restyleNow();

  vtkSmartPointer<vtkGenericOpenGLRenderWindow> window_;
  vtkSmartPointer<vtkRenderer> renderer_;
  double styled_ratio_ = 0.0;
  bool software_ = false;
  bool smooth_in_software_ = true;
};

}  // namespace fieldtrue::widgets
