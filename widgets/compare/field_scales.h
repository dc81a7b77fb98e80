#pragma once

#include <optional>
#include <span>

#include "widgets/figures/field_scale.h"
#include "widgets/views/field/volume_field.h"

namespace fieldtrue::widgets {

/// Colours and magnification that serve all fields and volumes shown at once.
FieldScale sharedScale(std::span<const ErrorField* const> fields, std::span<const VolumeField* const> volumes);

/// Whether an arrow is longer than the colours reach.
bool exceeds(std::span<const ErrorField* const> fields, double max_mm);

/// From the smallest SD of the fields to their 95th percentile, at least half as much again; none where no arrow has
/// one.
std::optional<OpacityRange> opacityRange(std::span<const ErrorField* const> fields);

}  // namespace fieldtrue::widgets
