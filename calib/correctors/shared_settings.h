#pragma once

#include "calib/core/settings.h"

namespace fieldtrue {

/// `degree` of a polynomial, 1 to 6 or auto, default 3: degree 4 needs five levels along every axis, more than a usual
/// grid has.
Setting degreeSetting();

/// `r2_cm2`, R^2 of the multiquadric, `auto` or 10 to 1000 cm2, default 100 (R = 10 cm, the geometric middle of the
/// range). The range is Zachmann's as the survey gives it, without a unit; cm2 is our reading.
Setting r2Setting();

/// `error_frame`, the frame in which the error rotation is modelled: `tracker` (default) or `sensor`.
Setting errorFrameSetting();

}  // namespace fieldtrue
