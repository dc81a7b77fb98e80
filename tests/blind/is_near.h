#pragma once

#include <QtGlobal>
#include <cmath>

namespace blind {

/// Whether a value is the expected one but for a share of it; says so where it is not.
inline bool isNear(double value, double expected, double share) {
  const bool is_near = std::abs(value - expected) <= share * std::abs(expected);
  if (!is_near) qWarning("%.9g, expected %.9g", value, expected);
  return is_near;
}

}  // namespace blind
