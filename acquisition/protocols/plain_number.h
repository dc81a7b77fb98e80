#pragma once

#include <string>

namespace fieldtrue::acquisition {

/// A number as a device writes and reads it, whatever the desktop's locale: a program with a window has that locale's
/// decimal comma in printf, which no tracker understands.
/// @param width filled with blanks at the left; 0 = as long as needed
std::string fixedText(double value, int decimals, int width = 0);

/// Exponent form with a sign column: " 1.23457E+02", "-1.23457E+02".
std::string exponentText(double value, int decimals);

}  // namespace fieldtrue::acquisition
