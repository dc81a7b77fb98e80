#pragma once

#include <vtkSmartPointer.h>

#include <QImage>
#include <QOpenGLWidget>

class vtkGenericOpenGLRenderWindow;
class vtkGenericRenderWindowInteractor;
class vtkRenderer;

namespace fieldtrue {

/// A VTK render window inside a Qt 6 window: one host for 3-D views and charts.
///
/// VTK draws in the widget's own context; repaints are asked for with requestRender() and happen once per event loop
/// turn.
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

  /// Hands a mouse event to VTK's interactor (charts); 3-D views answer the mouse themselves.
  void forwardToVtk(QEvent* event);

  /// Applies colours and text sizes; called once when the view is first drawn, on a theme change and on a new pixel
  /// ratio.
  virtual void restyle(double pixel_ratio);

  vtkGenericRenderWindowInteractor* interactor() const;

 private:
  void releaseGl();
  void blitToWidget();
  void useContext();
  void restyleNow();

  vtkSmartPointer<vtkGenericOpenGLRenderWindow> window_;
  vtkSmartPointer<vtkRenderer> renderer_;
  vtkSmartPointer<vtkGenericRenderWindowInteractor> interactor_;
  double styled_ratio_ = 0.0;
};

}  // namespace fieldtrue
