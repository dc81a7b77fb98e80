#include "widgets/views/host/offscreen_gl.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <vtkCallbackCommand.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <QGuiApplication>
#include <QImage>
#include <QOffscreenSurface>
#include <QOpenGLContext>
#include <cstring>
#include <string_view>
#include <vector>

namespace fieldtrue::widgets {
namespace {

constexpr int kMultiSamples = 8;
constexpr int kLargestSide_px = 8192;

/// A render window that takes whatever context is current.
class PictureWindow : public vtkGenericOpenGLRenderWindow {
 public:
  static PictureWindow* New();

  /// GLEW loads every OpenGL function from the current context and then fails where there is no X display to ask for
  /// GLX extensions. Nothing here uses those, so that failure does not count; the caller has made sure of a context.
  void OpenGLInitContext() override {
    const int warnings = vtkObject::GetGlobalWarningDisplay();
    vtkObject::SetGlobalWarningDisplay(0);
    vtkGenericOpenGLRenderWindow::OpenGLInitContext();
    vtkObject::SetGlobalWarningDisplay(warnings);
    this->GlewInitValid = true;
    this->Initialized = true;
  }

 protected:
  PictureWindow() = default;
};

class OffscreenContext {
 public:
  virtual ~OffscreenContext() = default;
  virtual bool makeCurrent() = 0;
};

/// Mesa's surfaceless platform needs no display server; a device, and last the default display, serve other drivers.
std::vector<EGLDisplay> eglDisplays() {
  std::vector<EGLDisplay> displays;
  const char* text = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const std::string_view extensions = text == nullptr ? "" : text;
  const auto get = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get != nullptr && extensions.find("EGL_MESA_platform_surfaceless") != std::string_view::npos)
    displays.push_back(get(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  const auto query = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  if (get != nullptr && query != nullptr && extensions.find("EGL_EXT_platform_device") != std::string_view::npos) {
    EGLDeviceEXT device = nullptr;
    EGLint count = 0;
    if (query(1, &device, &count) && count == 1) displays.push_back(get(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
  }
  return displays;
}

class EglContext : public OffscreenContext {
 public:
  static std::unique_ptr<EglContext> create() {
    static const std::vector<EGLDisplay> displays = eglDisplays();
    for (const EGLDisplay display : displays) {
      if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) continue;
      auto context = std::unique_ptr<EglContext>(new EglContext(display));
      if (context->make()) return context;
    }
    return nullptr;
  }

  ~EglContext() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (surface_ != EGL_NO_SURFACE) eglDestroySurface(display_, surface_);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
    // Qt may have asked for another API on this thread.
    eglBindAPI(former_api_);
  }

  bool makeCurrent() override { return eglMakeCurrent(display_, surface_, surface_, context_); }

 private:
  explicit EglContext(EGLDisplay display) : display_(display), former_api_(eglQueryAPI()) {}

  bool make() {
    if (!eglBindAPI(EGL_OPENGL_API)) return false;
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglChooseConfig(display_, wanted, &config, 1, &count) || count == 0) return false;
    const EGLint version[] = {
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 2, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, version);
    if (context_ == EGL_NO_CONTEXT) return false;
    const EGLint smallest[] = {EGL_WIDTH, 16, EGL_HEIGHT, 16, EGL_NONE};
    surface_ = eglCreatePbufferSurface(display_, config, smallest);
    return makeCurrent();
  }

  EGLDisplay display_;
  EGLenum former_api_;
  EGLContext context_ = EGL_NO_CONTEXT;
  EGLSurface surface_ = EGL_NO_SURFACE;
};

class QtContext : public OffscreenContext {
 public:
  static std::unique_ptr<QtContext> create() {
    if (qobject_cast<QGuiApplication*>(QCoreApplication::instance()) == nullptr) return nullptr;
    auto context = std::make_unique<QtContext>();
    QSurfaceFormat format;
    format.setVersion(3, 2);
    format.setProfile(QSurfaceFormat::CoreProfile);
    context->context_.setFormat(format);
    context->surface_.setFormat(format);
    context->surface_.create();
    if (!context->context_.create() || !context->makeCurrent()) return nullptr;
    return context;
  }

  ~QtContext() override { context_.doneCurrent(); }
  bool makeCurrent() override { return context_.makeCurrent(&surface_); }

 private:
  QOffscreenSurface surface_;
  QOpenGLContext context_;
};

/// Makes the caller's OpenGL context current again; two kinds of context cannot be current on one thread.
class CallersContext {
 public:
  CallersContext() : context_(QOpenGLContext::currentContext()) {
    if (context_ == nullptr) return;
    surface_ = context_->surface();
    context_->doneCurrent();
  }
  ~CallersContext() {
    if (context_ != nullptr) context_->makeCurrent(surface_);
  }

 private:
  QOpenGLContext* context_;
  QSurface* surface_ = nullptr;
};

void alwaysCurrent(vtkObject*, unsigned long, void*, void* answer) { *static_cast<bool*>(answer) = true; }

QImage readPixels(vtkGenericOpenGLRenderWindow* window, const QSize& size) {
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetPixelData(0, 0, size.width() - 1, size.height() - 1, 0, pixels.Get(), 0);
  if (pixels->GetNumberOfTuples() != static_cast<vtkIdType>(size.width()) * size.height()) return {};
  QImage image(size, QImage::Format_RGB888);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(size.width());
  for (int y = 0; y < size.height(); ++y)
    std::memcpy(image.scanLine(size.height() - 1 - y), pixels->GetPointer(0) + row_bytes * static_cast<std::size_t>(y),
                row_bytes);
  return image;
}

}  // namespace

vtkStandardNewMacro(PictureWindow);

Result<QImage> drawOffscreen(const QSize& size, int dots_per_inch,
                             const std::function<std::shared_ptr<void>(vtkRenderer*)>& build) {
  FT_CHECK(size.width() > 0 && size.height() > 0);
  if (size.width() > kLargestSide_px || size.height() > kLargestSide_px)
    return fail(ErrorCode::kUnsupported, "a picture of " + std::to_string(size.width()) + " x " +
                                             std::to_string(size.height()) + " pixels is too large: at most " +
                                             std::to_string(kLargestSide_px) + " on a side");
  const CallersContext callers_context;
  std::unique_ptr<OffscreenContext> context = EglContext::create();
  if (!context) context = QtContext::create();
  if (!context)
    return fail(
        ErrorCode::kUnsupported,
        "pictures need OpenGL 3.2, and this machine offers neither EGL without a display nor a display; install "
        "Mesa's libegl-mesa0 and libgl1-mesa-dri");
  vtkNew<PictureWindow> window;
  vtkNew<vtkCallbackCommand> is_current;
  is_current->SetCallback(alwaysCurrent);
  window->AddObserver(vtkCommand::WindowIsCurrentEvent, is_current);
  window->SetReadyForRendering(true);
  window->SetOwnContext(0);
  window->SetSupportsOpenGL(1);
  window->OpenGLInitContext();
  window->SetFrameBlitModeToNoBlit();
  window->SetMultiSamples(kMultiSamples);
  window->SetDPI(dots_per_inch);
  window->SetSize(size.width(), size.height());
  vtkNew<vtkRenderer> renderer;
  window->AddRenderer(renderer);
  const std::shared_ptr<void> scene = build(renderer);
  window->Render();
  const QImage image = readPixels(window, size);
  window->RemoveRenderer(renderer);
  window->Finalize();
  if (image.isNull()) return fail(ErrorCode::kUnsupported, "the graphics driver gave no picture back");
  return image;
}

}  // namespace fieldtrue::widgets
