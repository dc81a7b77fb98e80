#include "widgets/report/numbers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "calib/core/number_text.h"

namespace fieldtrue::widgets {

std::string errorFigure(double value) {
  const bool tiny = value > 0.0 && value < 0.001;
  return tiny ? "<0.001" : significantText(value);
}

std::string durationText(double seconds) {
  if (seconds < 1e-6) return significantText(seconds * 1e9) + " ns";
  if (seconds < 1e-3) return significantText(seconds * 1e6) + " us";
  if (seconds < 1.0) return significantText(seconds * 1e3) + " ms";
  return significantText(seconds) + " s";
}

}  // namespace fieldtrue::widgets
