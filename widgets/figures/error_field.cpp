#include "widgets/figures/error_field.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::widgets {
namespace {

constexpr double kFaintest = 0.12;

}  // namespace

double opacityOf(double uncertainty_mm, const OpacityRange& range) {
  if (!std::isfinite(uncertainty_mm)) return 1.0;
  const double along = (uncertainty_mm - range.opaque_mm) / std::max(range.faint_mm - range.opaque_mm, 1e-12);
  return 1.0 - (1.0 - kFaintest) * std::clamp(along, 0.0, 1.0);
}

}  // namespace fieldtrue::widgets
