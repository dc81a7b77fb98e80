#pragma once

#include <functional>
#include <memory>

#include "calib/core/error.h"

class vtkRenderer;
class QImage;
class QSize;

namespace fieldtrue::widgets {

/// Draws a scene into a picture without a window. A context of its own is current while `build` and the drawing run;
/// the caller's OpenGL context is current again afterwards.
/// @param build puts the scene into the renderer; what it returns is kept alive until the picture is read
/// @param dots_per_inch 72 makes a point of text one pixel
/// @error kUnsupported when no OpenGL 3.2 context can be made on this machine
Result<QImage> drawOffscreen(const QSize& size, int dots_per_inch,
                             const std::function<std::shared_ptr<void>(vtkRenderer*)>& build);

}  // namespace fieldtrue::widgets
