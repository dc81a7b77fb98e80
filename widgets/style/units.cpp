#include "widgets/style/units.h"

#include <QLocale>
#include <algorithm>
#include <cmath>

#include "calib/core/error.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {

QString unitSymbol(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMillimetre:
      return QStringLiteral("mm");
    case LengthUnit::kFoot:
      return QStringLiteral("ft");
    case LengthUnit::kInch:
      return QStringLiteral("in");
    case LengthUnit::kMetre:
      break;
  }
  return QStringLiteral("m");
}

double metresPer(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMillimetre:
      return 0.001;
    case LengthUnit::kFoot:
      return 0.3048;
    case LengthUnit::kInch:
      return 0.0254;
    case LengthUnit::kMetre:
      break;
  }
  return 1.0;
}

QString formatLength(double metres, LengthUnit unit, int significant) {
  FT_CHECK(significant >= 1);
  if (!std::isfinite(metres)) return QStringLiteral("unknown");
  // Rounded through text first: 0.9996 has one digit more before the point once rounded to three figures.
  const QString rounded = QLocale::c().toString(metres / metresPer(unit), 'e', significant - 1);
  const double value = rounded.toDouble();
  // Below a millionth of the unit the zeros would outnumber the figures; nobody places a sensor to a micrometre.
  if (std::abs(value) < 1e-6) return QStringLiteral("0 %1").arg(unitSymbol(unit));
  const int leading = static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-9));
  const int decimals = std::max(0, significant - 1 - leading);
  return QStringLiteral("%1 %2").arg(QLocale::c().toString(value, 'f', decimals).remove(QLatin1Char(',')),
                                     unitSymbol(unit));
}

}  // namespace fieldtrue::widgets
