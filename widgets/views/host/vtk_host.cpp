#include "widgets/views/host/vtk_host.h"

#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLState.h>
#include <vtkRenderer.h>

#include <QOpenGLContext>
#include <QOpenGLExtraFunctions>
#include <cmath>

#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kMultiSamples = 4;
/// With this resolution one point of VTK's font sizes is one pixel.
constexpr double kDotsPerInch = 72.0;

bool drawsInSoftware(QOpenGLContext* context) {
  const auto* name = reinterpret_cast<const char*>(context->functions()->glGetString(GL_RENDERER));
  const QByteArray renderer = QByteArray(name).toLower();
  return renderer.contains("llvmpipe") || renderer.contains("softpipe") || renderer.contains("swrast");
}

void answerIsCurrent(vtkObject*, unsigned long, void* host, void* answer) {
  *static_cast<bool*>(answer) = QOpenGLContext::currentContext() == static_cast<QOpenGLWidget*>(host)->context();
}

void makeContextCurrent(vtkObject*, unsigned long, void* host, void*) {
  // Not QOpenGLWidget::makeCurrent(): it also binds the widget's own framebuffer, and VTK's picture stays black.
  QOpenGLContext* context = static_cast<QOpenGLWidget*>(host)->context();
  if (context != nullptr && context->isValid()) context->makeCurrent(context->surface());
}

void observe(vtkObject* object, unsigned long event, void (*answer)(vtkObject*, unsigned long, void*, void*),
             void* host) {
  vtkNew<vtkCallbackCommand> command;
  command->SetCallback(answer);
  command->SetClientData(host);
  object->AddObserver(event, command);
}

}  // namespace

VtkHost::VtkHost(QWidget* parent)
    : QOpenGLWidget(parent),
      window_(vtkSmartPointer<vtkGenericOpenGLRenderWindow>::New()),
      renderer_(vtkSmartPointer<vtkRenderer>::New()) {
  window_->SetReadyForRendering(false);
  window_->AddRenderer(renderer_);
  observe(window_, vtkCommand::WindowIsCurrentEvent, answerIsCurrent, static_cast<QOpenGLWidget*>(this));
  observe(window_, vtkCommand::WindowMakeCurrentEvent, makeContextCurrent, static_cast<QOpenGLWidget*>(this));
  setMouseTracking(true);
  setFocusPolicy(Qt::StrongFocus);
  const auto restyleLater = [this] {
    styled_ratio_ = 0.0;
    requestRender();
  };
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, this, restyleLater);
  connect(&placingUnitNotifier(), &PlacingUnitNotifier::placingUnitChanged, this, restyleLater);
}

VtkHost::~VtkHost() {
  if (context() != nullptr) disconnect(context(), nullptr, this, nullptr);
  releaseGl();
  window_->RemoveAllObservers();
}

vtkGenericOpenGLRenderWindow* VtkHost::renderWindow() const { return window_; }

vtkRenderer* VtkHost::renderer() const { return renderer_; }

void VtkHost::requestRender() { update(); }

QImage VtkHost::picture() {
  if (!window_->GetReadyForRendering()) return {};
  return grabFramebuffer();
}

double VtkHost::pixelRatio() const { return devicePixelRatioF(); }

QSize VtkHost::sizeHint() const { return {640, 480}; }

QSize VtkHost::minimumSizeHint() const { return {160, 120}; }

void VtkHost::initializeGL() {
  // Moving the view to another window makes a new context.
  connect(context(), &QOpenGLContext::aboutToBeDestroyed, this, &VtkHost::releaseGl, Qt::DirectConnection);
  window_->SetReadyForRendering(true);
  window_->SetOwnContext(0);
  window_->SetSupportsOpenGL(1);
  window_->OpenGLInitContext();
  window_->SetFrameBlitModeToNoBlit();
  software_ = drawsInSoftware(context());
  updateSmoothness();
}

void VtkHost::setSmooth(bool in_software) {
  smooth_in_software_ = in_software;
  updateSmoothness();
}

void VtkHost::updateSmoothness() {
  // Without a graphics processor smooth edges triple the time of a frame (18 to 60 ms of processor time for 100
  // places).
  window_->SetMultiSamples(software_ && !smooth_in_software_ ? 0 : kMultiSamples);
}

void VtkHost::releaseGl() {
  if (context() == nullptr || !window_->GetReadyForRendering()) return;
  makeCurrent();
  window_->Finalize();
  window_->SetReadyForRendering(false);
  doneCurrent();
}

void VtkHost::resizeGL(int width, int height) {
  const int width_px = static_cast<int>(std::lround(width * pixelRatio()));
  const int height_px = static_cast<int>(std::lround(height * pixelRatio()));
  window_->SetSize(width_px, height_px);
}

void VtkHost::paintGL() {
  if (!window_->GetReadyForRendering()) return;
  if (styled_ratio_ != pixelRatio()) restyleNow();
  vtkOpenGLState* state = window_->GetState();
  state->Reset();
  state->Push();
  state->vtkglDepthFunc(GL_LEQUAL);
  prepareFrame();
  window_->Render();
  blitToWidget();
  state->Pop();
}

void VtkHost::restyleNow() {
  styled_ratio_ = pixelRatio();
  window_->SetDPI(static_cast<int>(std::lround(kDotsPerInch * styled_ratio_)));
  restyle(styled_ratio_);
}

void VtkHost::restyle(double) {}

void VtkHost::blitToWidget() {
  QOpenGLExtraFunctions* gl = context()->extraFunctions();
  const int* size = window_->GetSize();
  gl->glBindFramebuffer(GL_DRAW_FRAMEBUFFER, defaultFramebufferObject());
  window_->GetDisplayFramebuffer()->Bind(GL_READ_FRAMEBUFFER);
  window_->GetDisplayFramebuffer()->ActivateReadBuffer(0);
  vtkOpenGLState* state = window_->GetState();
  state->vtkglDisable(GL_SCISSOR_TEST);
  gl->glBlitFramebuffer(0, 0, size[0], size[1], 0, 0, size[0], size[1], GL_COLOR_BUFFER_BIT, GL_NEAREST);
  gl->glBindFramebuffer(GL_FRAMEBUFFER, defaultFramebufferObject());
  // VTK leaves the background transparent; the window must not show through.
  state->vtkglColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_TRUE);
  state->vtkglClearColor(0.0F, 0.0F, 0.0F, 1.0F);
  gl->glClear(GL_COLOR_BUFFER_BIT);
  state->vtkglColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

bool VtkHost::event(QEvent* event) {
  const bool handled = QOpenGLWidget::event(event);
  if (event->type() == QEvent::ScreenChangeInternal && styled_ratio_ != 0.0) requestRender();
  return handled;
}

}  // namespace fieldtrue::widgets
