#pragma once

#include <Eigen/Core>
#include <QString>

#include "widgets/views/theme.h"

namespace fieldtrue {

/// The unit places are named in, chosen by the person and remembered. Errors are always in mm.
LengthUnit placingUnit();
void setPlacingUnit(LengthUnit unit);

/// "x 1.22 m   y 0.61 m   z 0.91 m" in the placing unit.
QString positionText(const Eigen::Vector3d& position_m);
/// An error or SD in mm, three significant figures: "0.412 mm", "41.3 mm".
QString errorText(double error_m);
/// A number to three significant figures, without exponents.
QString threeFigures(double value);

}  // namespace fieldtrue
