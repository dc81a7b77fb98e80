#include "widgets/views/host/gl_format.h"

#include <QSurfaceFormat>

namespace fieldtrue::widgets {

void setDefaultGlFormat() {
  QSurfaceFormat format;
  format.setRenderableType(QSurfaceFormat::OpenGL);
  format.setVersion(3, 2);
  format.setProfile(QSurfaceFormat::CoreProfile);
  // A forward-compatible context would draw every line one pixel wide, too thin on dense screens.
  format.setOption(QSurfaceFormat::DeprecatedFunctions);
  format.setSwapBehavior(QSurfaceFormat::DoubleBuffer);
  format.setRedBufferSize(8);
  format.setGreenBufferSize(8);
  format.setBlueBufferSize(8);
  format.setAlphaBufferSize(8);
  format.setDepthBufferSize(24);
  format.setStencilBufferSize(8);
  // VTK smooths edges in its own framebuffer.
  format.setSamples(0);
  QSurfaceFormat::setDefaultFormat(format);
}

}  // namespace fieldtrue::widgets
