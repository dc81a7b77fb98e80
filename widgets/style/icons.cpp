#include "widgets/style/icons.h"

#include <QDir>
#include <QFile>
#include <QIconEngine>
#include <QPainter>
#include <QPixmap>
#include <QSvgRenderer>
#include <optional>

#include "calib/core/error.h"
#include "widgets/style/theme.h"

static void initIcons() { Q_INIT_RESOURCE(fieldtrue); }

namespace fieldtrue::widgets {
namespace {

/// Draws one symbol in the theme's colours of the moment, so that icons already in use follow a theme change.
class SymbolEngine : public QIconEngine {
 public:
  SymbolEngine(QByteArray svg, std::optional<QColor> color) : svg_(std::move(svg)), color_(color) {}

  void paint(QPainter* painter, const QRect& rect, QIcon::Mode mode, QIcon::State) override {
    QByteArray svg = svg_;
    svg.replace("currentColor", colorFor(mode).name().toLatin1());
    QSvgRenderer renderer(svg);
    renderer.setAspectRatioMode(Qt::KeepAspectRatio);
    if (mode == QIcon::Disabled) painter->setOpacity(painter->opacity() * 0.5);
    renderer.render(painter, rect);
  }

  QPixmap pixmap(const QSize& size, QIcon::Mode mode, QIcon::State state) override {
    QPixmap picture(size);
    picture.fill(Qt::transparent);
    QPainter painter(&picture);
    paint(&painter, QRect(QPoint(0, 0), size), mode, state);
    return picture;
  }

  QIconEngine* clone() const override { return new SymbolEngine(*this); }

 private:
  QColor colorFor(QIcon::Mode mode) const {
    if (color_) return *color_;
    return mode == QIcon::Disabled ? theme().text_muted : theme().text;
  }

  QByteArray svg_;
  std::optional<QColor> color_;
};

QIcon makeIcon(const QString& name, std::optional<QColor> color) {
  initIcons();
  QFile file(QStringLiteral(":/icons/%1.svg").arg(name));
  FT_CHECK(file.open(QIODevice::ReadOnly));
  return QIcon(new SymbolEngine(file.readAll(), color));
}

}  // namespace

QIcon icon(const QString& name) { return makeIcon(name, std::nullopt); }

QIcon icon(const QString& name, const QColor& color) { return makeIcon(name, color); }

QStringList iconNames() {
  initIcons();
  QStringList names = QDir(QStringLiteral(":/icons")).entryList({QStringLiteral("*.svg")}, QDir::Files, QDir::Name);
  for (QString& name : names) name.chop(4);
  return names;
}

}  // namespace fieldtrue::widgets
