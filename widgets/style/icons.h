#pragma once

#include <QColor>
#include <QIcon>
#include <QString>
#include <QStringList>

namespace fieldtrue::widgets {

/// One of our own symbols, drawn in the current theme's text colour at any size; follows theme changes by itself.
/// @param name one of iconNames()
QIcon icon(const QString& name);

/// The same symbol in a fixed colour, for a state mark.
QIcon icon(const QString& name, const QColor& color);

QStringList iconNames();

}  // namespace fieldtrue::widgets
