#pragma once

#include <QString>
#include <map>
#include <optional>

#include "calib/evaluation/comparison.h"
#include "widgets/figures/error_field.h"

namespace fieldtrue::widgets {

/// A row of one part of a comparison; none = before correction.
using MethodRow = std::optional<std::size_t>;

/// "Polynomial", or "Polynomial (degree 4)" where settings differ from the defaults.
QString positionLabel(const evaluation::MethodScore& score);
QString orientationLabel(const evaluation::MethodScore& score);
/// The same for a row; "Before correction" for none.
QString positionLabel(const evaluation::Comparison& comparison, MethodRow row);

/// Which row a method stands in: the best one of its rows when it was compared with several settings; none when it was
/// not compared, cannot be used, or is no correction at all.
MethodRow positionRow(const evaluation::Comparison& comparison, const QString& method);
MethodRow orientationRow(const evaluation::Comparison& comparison, const QString& method);

/// Held-out errors per place [mm].
const std::vector<double>& heldOutErrors_mm(const evaluation::Comparison& comparison, MethodRow row);

/// Mean true position of each place that is not skipped, reference frame [m].
std::map<int, Eigen::Vector3d> truePositions_m(const CalibrationTable& table);

/// The held-out error field of a method as arrows at the true positions.
/// @param orientation row of the orientation part whose held-out angles are drawn
ErrorField heldOutField(const evaluation::Comparison& comparison, const CalibrationTable& table, MethodRow position,
                        MethodRow orientation, const QString& title = {});

/// Where two methods disagree on places neither saw: arrows of the residual of A minus that of B, coloured by which of
/// them is nearer the truth.
ErrorField differenceField(const evaluation::Comparison& comparison, const CalibrationTable& table, MethodRow a,
                           MethodRow b);

}  // namespace fieldtrue::widgets
