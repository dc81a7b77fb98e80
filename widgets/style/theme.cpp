#include "widgets/style/theme.h"

#include <QFile>
#include <QGuiApplication>
#include <QPalette>
#include <QStyle>
#include <QStyleFactory>
#include <QTextStream>
#include <utility>
#include <vector>

#include "calib/core/error.h"
#include "widgets/style/color_scale.h"

// Static libraries drop resources nobody names, and Q_INIT_RESOURCE must stand outside of namespaces.
static void initResources() { Q_INIT_RESOURCE(fieldtrue); }

namespace fieldtrue::widgets {
namespace {

Theme lightTheme() {
  Theme t;
  t.dark = false;
  t.background = QColor(0xf3, 0xf5, 0xf7);
  t.surface = QColor(0xff, 0xff, 0xff);
  t.text = QColor(0x17, 0x20, 0x2a);
  t.text_muted = QColor(0x55, 0x62, 0x70);
  t.accent = QColor(0x0a, 0x63, 0xc2);
  t.attention = QColor(0x9a, 0x5b, 0x00);
  t.danger = QColor(0xc0, 0x24, 0x2b);
  t.done = QColor(0x13, 0x74, 0x4f);
  t.line = QColor(0xcf, 0xd6, 0xdd);
  t.on_accent = t.surface;
  return t;
}

Theme darkTheme() {
  Theme t;
  t.dark = true;
  t.background = QColor(0x11, 0x16, 0x1b);
  t.surface = QColor(0x1a, 0x21, 0x28);
  t.text = QColor(0xe9, 0xee, 0xf3);
  t.text_muted = QColor(0x9a, 0xa7, 0xb4);
  t.accent = QColor(0x5a, 0xae, 0xff);
  t.attention = QColor(0xf2, 0xb1, 0x3d);
  t.danger = QColor(0xff, 0x78, 0x6e);
  t.done = QColor(0x4f, 0xc7, 0x8f);
  t.line = QColor(0x34, 0x3f, 0x4a);
  t.on_accent = t.background;
  return t;
}

const Theme*& current() {
  static const Theme* pointer = &Theme::of(false);
  return pointer;
}

QColor disabled(const Theme& t) { return mixed(t.text_muted, t.surface, 0.4); }

QPalette paletteOf(const Theme& t) {
  QPalette p;
  p.setColor(QPalette::Window, t.background);
  p.setColor(QPalette::WindowText, t.text);
  p.setColor(QPalette::Base, t.surface);
  p.setColor(QPalette::AlternateBase, t.background);
  p.setColor(QPalette::Text, t.text);
  p.setColor(QPalette::PlaceholderText, t.text_muted);
  p.setColor(QPalette::Button, t.surface);
  p.setColor(QPalette::ButtonText, t.text);
  p.setColor(QPalette::BrightText, t.danger);
  p.setColor(QPalette::ToolTipBase, t.surface);
  p.setColor(QPalette::ToolTipText, t.text);
  p.setColor(QPalette::Highlight, t.accent);
  p.setColor(QPalette::HighlightedText, t.on_accent);
  p.setColor(QPalette::Link, t.accent);
  p.setColor(QPalette::LinkVisited, t.accent);
  p.setColor(QPalette::Mid, t.line);
  p.setColor(QPalette::Dark, t.line.darker(140));
  p.setColor(QPalette::Light, t.line.lighter(120));
  for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
    p.setColor(QPalette::Disabled, role, disabled(t));
  return p;
}

QString styleSheetOf(const Theme& t) {
  QFile file(QStringLiteral(":/style/fieldtrue.qss"));
  FT_CHECK(file.open(QIODevice::ReadOnly));
  QString sheet = QString::fromUtf8(file.readAll());
  const auto soft = [&t](const QColor& color) { return mixed(t.surface, color, t.dark ? 0.22 : 0.14); };
  // Longer names first: "@accent" also begins "@accent_soft".
  const std::vector<std::pair<const char*, QColor>> colors = {
      {"@accent_strong", t.dark ? t.accent.lighter(112) : t.accent.darker(118)},
      {"@accent_soft", soft(t.accent)},
      {"@attention_soft", soft(t.attention)},
      {"@danger_soft", soft(t.danger)},
      {"@done_soft", soft(t.done)},
      {"@on_accent", t.on_accent},
      {"@background", t.background},
      {"@attention", t.attention},
      {"@disabled", disabled(t)},
      {"@surface", t.surface},
      {"@handle", mixed(t.line, t.text_muted, 0.4)},
      {"@accent", t.accent},
      {"@danger", t.danger},
      {"@muted", t.text_muted},
      {"@done", t.done},
      {"@line", t.line},
      {"@text", t.text},
  };
  sheet.replace(QLatin1String("@check_image"),
                QLatin1String(t.dark ? ":/style/check_dark.svg" : ":/style/check_light.svg"));
  for (const auto& [name, color] : colors) sheet.replace(QLatin1String(name), color.name());
  return sheet;
}

}  // namespace

const Theme& Theme::of(bool dark) {
  static const Theme light = lightTheme();
  static const Theme night = darkTheme();
  return dark ? night : light;
}

const Theme& theme() { return *current(); }

ThemeNotifier& themeNotifier() {
  static ThemeNotifier notifier;
  return notifier;
}

void applyTheme(QApplication& application, bool dark) {
  initResources();
  current() = &Theme::of(dark);
  application.setStyle(QStyleFactory::create(QStringLiteral("Fusion")));
  application.setPalette(paletteOf(theme()));
  application.setStyleSheet(styleSheetOf(theme()));
  emit themeNotifier().themeChanged(dark);
}

void restyle(QWidget& widget) {
  widget.style()->unpolish(&widget);
  widget.style()->polish(&widget);
}

bool setStyled(QWidget& widget, const char* property, const QVariant& value) {
  if (widget.property(property) == value) return false;
  widget.setProperty(property, value);
  restyle(widget);
  return true;
}

bool systemPrefersDark() {
  const QPalette palette = QGuiApplication::palette();
  return palette.color(QPalette::WindowText).lightness() > palette.color(QPalette::Window).lightness();
}

}  // namespace fieldtrue::widgets
