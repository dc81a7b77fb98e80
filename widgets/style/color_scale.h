#pragma once

#include <QColor>

namespace fieldtrue::widgets {

/// A colour between two.
/// @param share_of_b 0 gives a, 1 gives b
QColor mixed(const QColor& a, const QColor& b, double share_of_b);

/// Colour of a magnitude on the perceptually uniform scale every error view shares.
/// @param fraction of the scale's maximum; below 0 and above 1 clamp; NaN gives a neutral grey
/// @source viridis control colours, S. van der Walt and N. Smith 2015
QColor magnitudeColor(double fraction);

/// Colour of a difference on a diverging scale that colour-blind people tell apart: blue below 0, grey at 0, orange
/// above.
/// @param fraction of the scale's end; beyond -1 and 1 clamp; NaN gives a neutral grey
QColor differenceColor(double fraction);

}  // namespace fieldtrue::widgets
