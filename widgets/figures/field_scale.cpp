#include "widgets/figures/field_scale.h"

#include <algorithm>
#include <vector>

#include "calib/core/statistics.h"
#include "widgets/figures/scene_space.h"

namespace fieldtrue::widgets {

FieldScale fieldScale(const ErrorField& before) {
  std::vector<double> errors_mm;
  std::vector<Eigen::Vector3d> points_m;
  for (const FieldArrow& arrow : before.arrows) {
    errors_mm.push_back(1000.0 * arrow.error_m.norm());
    points_m.push_back(arrow.from_m);
  }
  const double typical_mm = errors_mm.empty() ? 0.0 : quantile(errors_mm, 0.95);
  if (!(typical_mm > 0.0)) return {};
  double pitch_mm = 1000.0 * gridPitch_m(points_m).minCoeff();
  if (!(pitch_mm > 0.0)) pitch_mm = 100.0;
  const double at_most = 0.8 * pitch_mm / typical_mm;
  // roundStep goes up to 1, 2, 5, 10; 0.4 of the limit therefore never passes it.
  return {roundStep(typical_mm), std::max(1.0, roundStep(0.4 * at_most))};
}

}  // namespace fieldtrue::widgets
