#include "widgets/figures/difference_field.h"

namespace fieldtrue::widgets {

ErrorField differenceField(const evaluation::CalibrationDifference& difference, std::size_t most) {
  ErrorField field;
  field.title = difference.n_orientations > 1
                    ? QStringLiteral("Largest change from the first to the second, of all orientations")
                    : QStringLiteral("Change from the first to the second");
  const std::size_t step = difference.points.size() / most + 1;
  for (std::size_t i = 0; i < difference.points.size(); ++i) {
    const bool is_worst = i == difference.worst;
    if (i % step != 0 && !is_worst) continue;
    FieldArrow arrow;
    arrow.from_m = difference.points[i].reference_m;
    arrow.error_m = difference.points[i].change_m;
    arrow.node = static_cast<int>(i);
    arrow.name = is_worst ? QStringLiteral("Largest change") : QStringLiteral("Point %1").arg(i + 1);
    field.arrows.push_back(std::move(arrow));
  }
  return field;
}

}  // namespace fieldtrue::widgets
