#pragma once

#include <string>

/// Numbers as people read them, independent of the locale, which a desktop program sets and which may write a decimal
/// comma.
namespace fieldtrue {

/// So many decimals; "n/a" for NaN and infinity.
std::string fixedText(double value, int decimals);

/// So many significant digits, no exponent, trailing zeros kept ("0.412", "41.3", "1240"); "n/a" for NaN and infinity.
/// @param digits at least 1
std::string significantText(double value, int digits = 3);

/// Three significant figures without trailing zeros, to a millionth.
std::string shortNumber(double value);

}  // namespace fieldtrue
