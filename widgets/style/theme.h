#pragma once

#include <QApplication>
#include <QColor>
#include <QIcon>
#include <QObject>
#include <QString>
#include <QStringList>
#include <QVariant>
#include <QWidget>

namespace fieldtrue::widgets {

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

/// Draws a widget anew after a property that the style sheet asks for was set.
void restyle(QWidget& widget);

/// Sets such a property and, where that changes it, draws the widget anew.
/// @return whether it was changed
bool setStyled(QWidget& widget, const char* property, const QVariant& value);

/// Whether the desktop's own palette is a dark one. Call before applyTheme.
bool systemPrefersDark();

}  // namespace fieldtrue::widgets
