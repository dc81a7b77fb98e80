#include "widgets/style/unit_texts.h"

#include <QLocale>
#include <QObject>
#include <QSettings>
#include <QStringList>
#include <algorithm>
#include <cmath>

#include "calib/core/pose.h"
#include "calib/core/units.h"
#include "widgets/style/units.h"

namespace fieldtrue::widgets {
namespace {

const QString kKey = QStringLiteral("placing_unit");

}  // namespace

LengthUnit placingUnit() {
  return static_cast<LengthUnit>(QSettings().value(kKey, static_cast<int>(LengthUnit::kMetre)).toInt());
}

void setPlacingUnit(LengthUnit unit) {
  if (unit == placingUnit()) return;
  QSettings().setValue(kKey, static_cast<int>(unit));
  emit placingUnitNotifier().placingUnitChanged();
}

PlacingUnitNotifier& placingUnitNotifier() {
  static PlacingUnitNotifier notifier;
  return notifier;
}

QString coordinateText(double coordinate_m) {
  const LengthUnit unit = placingUnit();
  const int decimals = std::max(0, enteredDecimals(unit) - 1);
  // Rounded first, so that a tiny negative number does not read -0.000.
  const double scale = std::pow(10.0, decimals);
  const double value = std::round(coordinate_m / metresPer(unit) * scale) / scale + 0.0;
  return QStringLiteral("%1 %2").arg(QLocale::c().toString(value, 'f', decimals), unitSymbol(unit));
}

QString positionText(const Eigen::Vector3d& position_m) {
  return QStringLiteral("x %1   y %2   z %3")
      .arg(coordinateText(position_m.x()), coordinateText(position_m.y()), coordinateText(position_m.z()));
}

QString turnText(const Eigen::Quaterniond& q) {
  const Eigen::Vector3d angles_deg = kDegPerRad * eulerFromRotation_rad(q);
  return QObject::tr("azimuth %1\u00b0   elevation %2\u00b0   roll %3\u00b0")
      .arg(angles_deg.x(), 0, 'f', 1)
      .arg(angles_deg.y(), 0, 'f', 1)
      .arg(angles_deg.z(), 0, 'f', 1);
}

QString shortTurnText(const Eigen::Quaterniond& q) {
  QStringList angles;
  for (const double angle_rad : eulerFromRotation_rad(q))
    angles << QStringLiteral("%1°").arg(std::lround(kDegPerRad * angle_rad));
  return angles.join(QStringLiteral(", "));
}

QString distanceText(double distance_m) {
  const LengthUnit unit = placingUnit();
  const bool imperial = unit == LengthUnit::kFoot || unit == LengthUnit::kInch;
  if (distance_m >= (imperial ? 0.3048 : 0.1)) return formatLength(distance_m, unit, 2);
  if (imperial) return QStringLiteral("%1 in").arg(distance_m / metresPer(LengthUnit::kInch), 0, 'f', 1);
  return QStringLiteral("%1 mm").arg(distance_m * 1000.0, 0, 'f', 0);
}

int enteredDecimals(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMetre:
      return 4;
    case LengthUnit::kMillimetre:
      return 1;
    case LengthUnit::kFoot:
      return 3;
    case LengthUnit::kInch:
      return 2;
  }
  return 3;
}

QString threeFigures(double value) {
  if (!std::isfinite(value)) return QStringLiteral("n/a");
  if (value == 0.0) return QStringLiteral("0");
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value))));
  return QLocale::c().toString(value, 'f', std::clamp(2 - magnitude, 0, 6));
}

QString millimetreText(double error_m) { return QStringLiteral("%1 mm").arg(threeFigures(error_m * 1000.0)); }

}  // namespace fieldtrue::widgets
