#pragma once

class vtkTextProperty;

namespace fieldtrue::widgets {

/// Sets the typeface of text drawn by VTK: DejaVu Sans or Noto Sans where the system has it, else VTK's own.
void setFont(vtkTextProperty* text, bool bold);

}  // namespace fieldtrue::widgets
