#pragma once

#include <string>

namespace fieldtrue {

/// A number as people read it: so many significant digits, no exponent, trailing zeros kept ("0.412", "41.3", "1240").
/// @param digits at least 1
/// @return "n/a" for NaN and infinity
std::string significantText(double value, int digits = 3);

/// An error in its usual unit (mm, degrees): three significant digits, and "<0.001" instead of rounding noise.
std::string errorFigure(double value);

/// A number with a fixed count of decimals; "n/a" for NaN and infinity.
std::string decimalText(double value, int decimals);

/// A duration in the unit that suits it: "120 ns", "3.10 us", "12.0 ms", "2.40 s".
std::string durationText(double seconds);

}  // namespace fieldtrue
