#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <QObject>
#include <QString>

#include "widgets/style/theme.h"
#include "widgets/style/units.h"

namespace fieldtrue::widgets {

/// The unit places are named in, chosen by the person and remembered. Errors are always in mm.
LengthUnit placingUnit();
void setPlacingUnit(LengthUnit unit);

/// Tells when another was chosen: what is shown by then is told in it too.
class PlacingUnitNotifier : public QObject {
  Q_OBJECT
 signals:
  void placingUnitChanged();
};
PlacingUnitNotifier& placingUnitNotifier();

/// A coordinate to the nearest millimetre or so, so that a live number does not jump in length: "1.219 m", "4.00 ft".
QString coordinateText(double coordinate_m);
/// "x 1.219 m   y 0.610 m   z 0.914 m" in the placing unit.
QString positionText(const Eigen::Vector3d& position_m);
/// An orientation as the trackers name it: "azimuth 120.0°   elevation 0.0°   roll -90.0°".
QString turnText(const Eigen::Quaterniond& q);
/// The same to the nearest degree: "120°, 0°, -90°".
QString shortTurnText(const Eigen::Quaterniond& q);
/// How far there is still to go, in the smaller unit when that is near: "0.42 m", "7 mm", "0.3 in".
QString distanceText(double distance_m);
/// Decimals with which a length of this unit is told and entered: a tenth of a millimetre.
int enteredDecimals(LengthUnit unit);
/// An error or SD in mm, three significant figures: "0.412 mm", "41.3 mm".
QString millimetreText(double error_m);
/// A number to three significant figures, without exponents.
QString threeFigures(double value);

}  // namespace fieldtrue::widgets
