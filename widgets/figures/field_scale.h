#pragma once

#include "widgets/figures/error_field.h"

namespace fieldtrue::widgets {

/// Colour scale and arrow length that all fields compared share.
struct FieldScale {
  double max_mm = 1.0;
  double magnification = 1.0;
};

/// Round values such that all but a few arrows of the field are inside the colours and arrows stay shorter than the
/// pitch.
/// @param before the field with the largest errors: before correction
FieldScale fieldScale(const ErrorField& before);

}  // namespace fieldtrue::widgets
