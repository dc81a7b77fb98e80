#include "widgets/pages/units.h"

#include <QLocale>
#include <QSettings>
#include <algorithm>
#include <cmath>

namespace fieldtrue {
namespace {

const QString kKey = QStringLiteral("placing_unit");

}  // namespace

LengthUnit placingUnit() {
  return static_cast<LengthUnit>(QSettings().value(kKey, static_cast<int>(LengthUnit::kMetre)).toInt());
}

void setPlacingUnit(LengthUnit unit) { QSettings().setValue(kKey, static_cast<int>(unit)); }

QString positionText(const Eigen::Vector3d& position_m) {
  const LengthUnit unit = placingUnit();
  return QStringLiteral("x %1   y %2   z %3")
      .arg(formatLength(position_m.x(), unit), formatLength(position_m.y(), unit), formatLength(position_m.z(), unit));
}

QString threeFigures(double value) {
  if (!std::isfinite(value)) return QStringLiteral("n/a");
  if (value == 0.0) return QStringLiteral("0");
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value))));
  return QLocale::c().toString(value, 'f', std::clamp(2 - magnitude, 0, 6));
}

QString errorText(double error_m) { return QStringLiteral("%1 mm").arg(threeFigures(error_m * 1000.0)); }

}  // namespace fieldtrue
