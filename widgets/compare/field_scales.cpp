#include "widgets/compare/field_scales.h"

#include <algorithm>
#include <cmath>

#include "calib/core/statistics.h"
#include "widgets/figures/scene_space.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kMostCells = 0.95;  ///< Share of the values that the colours reach.
constexpr double kLeastSpread = 1.5;

}  // namespace

FieldScale sharedScale(std::span<const ErrorField* const> fields, std::span<const VolumeField* const> volumes) {
  ErrorField all;
  for (const ErrorField* field : fields)
    all.arrows.insert(all.arrows.end(), field->arrows.begin(), field->arrows.end());
  FieldScale scale = fieldScale(all);
  for (const VolumeField* volume : volumes) {
    std::vector<double> known;
    std::copy_if(volume->values_mm.begin(), volume->values_mm.end(), std::back_inserter(known),
                 [](double value) { return std::isfinite(value); });
    const double typical_mm = known.empty() ? 0.0 : quantile(known, kMostCells);
    if (typical_mm > scale.max_mm) scale.max_mm = roundStep(typical_mm);
  }
  return scale;
}

bool exceeds(std::span<const ErrorField* const> fields, double max_mm) {
  const auto longer = [max_mm](const FieldArrow& arrow) {
    const double shown_mm = arrow.better_mm ? std::abs(*arrow.better_mm) : 1000.0 * arrow.error_m.norm();
    return shown_mm > max_mm * (1.0 + 1e-9);
  };
  return std::any_of(fields.begin(), fields.end(), [&](const ErrorField* field) {
    return std::any_of(field->arrows.begin(), field->arrows.end(), longer);
  });
}

std::optional<OpacityRange> opacityRange(std::span<const ErrorField* const> fields) {
  std::vector<double> sds_mm;
  for (const ErrorField* field : fields)
    for (const FieldArrow& arrow : field->arrows)
      if (arrow.uncertainty_mm) sds_mm.push_back(*arrow.uncertainty_mm);
  if (sds_mm.empty()) return std::nullopt;
  const double least_mm = *std::min_element(sds_mm.begin(), sds_mm.end());
  // Nearly even SDs shall not look as if they differed much.
  return OpacityRange{least_mm, std::max(quantile(sds_mm, kMostCells), kLeastSpread * least_mm)};
}

}  // namespace fieldtrue::widgets
