#pragma once

#include <QApplication>
#include <QColor>
#include <QIcon>
#include <QObject>
#include <QString>
#include <QStringList>

namespace fieldtrue {

/// The colours of the program, one set for a light and one for a dark desktop.
struct Theme {
  bool dark = false;
  QColor background;  ///< Behind everything, also behind the 3-D scene.
  QColor surface;     ///< Panels, fields, menus.
  QColor text;
  QColor text_muted;
  QColor accent;     ///< The one accent colour: what to do next.
  QColor attention;  ///< Amber: needs the operator.
  QColor danger;     ///< Red: lost data or tracker, nothing else.
  QColor done;
  QColor on_accent;  ///< Words and symbols on a field of the accent colour.
  QColor line;       ///< Separators, grid lines.

  /// The light or the dark set.
  static const Theme& of(bool dark);
};

/// The theme in use; light until applyTheme is called.
const Theme& theme();

/// Tells when the theme was changed: `connect(&themeNotifier(), &ThemeNotifier::themeChanged, ...)`.
class ThemeNotifier : public QObject {
  Q_OBJECT
 signals:
  void themeChanged(bool dark);
};
ThemeNotifier& themeNotifier();

/// Sets Fusion, the palette and the style sheet (`:/style/fieldtrue.qss`, with `@surface` and the like replaced by
/// colours).
void applyTheme(QApplication& application, bool dark);

/// Whether the desktop's own palette is a dark one. Call before applyTheme.
bool systemPrefersDark();

/// One of our own symbols, drawn in the current theme's text colour at any size; follows theme changes by itself.
/// @param name one of iconNames()
QIcon icon(const QString& name);

/// The same symbol in a fixed colour, for a state mark.
QIcon icon(const QString& name, const QColor& color);

QStringList iconNames();

/// Colour of a magnitude on the perceptually uniform scale every error view shares.
/// @param fraction of the scale's maximum; below 0 and above 1 clamp; NaN gives a neutral grey
/// @source viridis control colours, S. van der Walt and N. Smith 2015
QColor magnitudeColor(double fraction);

/// Colour of a difference on a diverging scale that colour-blind people tell apart: blue below 0, grey at 0, orange
/// above.
/// @param fraction of the scale's end; beyond -1 and 1 clamp; NaN gives a neutral grey
QColor differenceColor(double fraction);

/// Unit in which places are told to the operator. Errors are always in mm.
enum class LengthUnit { kMetre, kMillimetre, kFoot, kInch };

/// A length as a person reads it: "0.305 m", "12.0 in".
/// @param metres length [m]; NaN and infinity give "unknown"
/// @param significant figures, at least 1
QString formatLength(double metres, LengthUnit unit, int significant = 3);

/// "m", "mm", "ft" or "in".
QString unitSymbol(LengthUnit unit);

/// Metres in one unit.
double metresPer(LengthUnit unit);

}  // namespace fieldtrue
