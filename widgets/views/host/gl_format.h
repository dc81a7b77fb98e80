#pragma once

namespace fieldtrue::widgets {

/// Sets the default surface format the 3-D views need (OpenGL 3.2 core profile). Call before the application object is
/// made.
void setDefaultGlFormat();

}  // namespace fieldtrue::widgets
