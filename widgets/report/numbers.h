#pragma once

#include <string>

namespace fieldtrue::widgets {

/// An error in its usual unit (mm, degrees): three significant digits, and "<0.001" instead of rounding noise.
std::string errorFigure(double value);

/// A duration in the unit that suits it: "120 ns", "3.10 us", "12.0 ms", "2.40 s".
std::string durationText(double seconds);

}  // namespace fieldtrue::widgets
