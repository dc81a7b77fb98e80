#pragma once

#include <QString>

namespace fieldtrue::widgets {

/// Unit in which places are told to the operator. Errors are always in mm.
enum class LengthUnit { kMetre, kMillimetre, kFoot, kInch };

/// A length as a person reads it: "0.305 m", "12.0 in".
/// @param metres length [m]; NaN and infinity give "unknown"
/// @param significant figures, at least 1
QString formatLength(double metres, LengthUnit unit, int significant = 3);

/// "m", "mm", "ft" or "in".
QString unitSymbol(LengthUnit unit);

/// Metres in one unit.
double metresPer(LengthUnit unit);

}  // namespace fieldtrue::widgets
