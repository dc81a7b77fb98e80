#include "widgets/views/charts/sketch_view.h"

#include <QPainter>
#include <algorithm>
#include <cmath>

#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kArrow_px = 8.0;
constexpr double kShare = 0.46;  ///< Of the room, from the middle to the box's side.

QColor colorOf(Tone tone) {
  const Theme& colors = theme();
  const QColor of[] = {colors.text_muted, colors.text, colors.accent, colors.attention};
  return of[static_cast<std::size_t>(tone)];
}

/// Paper to pixels of a widget.
struct Paper {
  QPointF middle;
  double scale = 1.0;
  double wide = 1.0;  ///< A chart is as wide as there is room.
  bool is_flat = false;

  QPointF at(const Eigen::Vector3d& point) const {
    const Eigen::Vector2d on = onPaper(point, is_flat);
    return middle + scale * QPointF(wide * on.x(), -on.y());
  }
};

void drawArrow(QPainter& painter, const QPointF& from, const QPointF& to) {
  const QPointF along = to - from;
  const double length = std::hypot(along.x(), along.y());
  if (length < 1.0) return;
  const QPointF back = -kArrow_px / length * along;
  const QPointF across(-0.45 * back.y(), 0.45 * back.x());
  painter.setBrush(painter.pen().color());
  painter.drawPolygon(QPolygonF({to, to + back + across, to + back - across}));
  painter.setBrush(Qt::NoBrush);
}

}  // namespace

SketchView::SketchView(QWidget* parent) : QWidget(parent) {
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, this, qOverload<>(&QWidget::update));
}

void SketchView::setSketch(const Sketch& sketch) {
  sketch_ = sketch;
  setAccessibleName(QString::fromStdString(sketch_.words));
  setToolTip(accessibleName());
  update();
}

void SketchView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const double scale = kShare * std::min(width(), height());
  const Paper paper{QRectF(rect()).center(), scale, sketch_.is_flat ? kShare * width() / scale : 1.0, sketch_.is_flat};
  for (const Sketch::Line& line : sketch_.lines) {
    painter.setPen(
        QPen(colorOf(line.tone), line.tone == Tone::kMuted ? 1.2 : 2.0, line.is_dashed ? Qt::DashLine : Qt::SolidLine));
    QPolygonF points;
    for (const Eigen::Vector3d& point : line.points) points << paper.at(point);
    painter.drawPolyline(points);
    painter.setPen(QPen(colorOf(line.tone), 1.2));
    if (line.has_arrow && points.size() >= 2) drawArrow(painter, points[points.size() - 2], points.back());
  }
  for (const Sketch::Dot& dot : sketch_.dots) {
    painter.setPen(QPen(colorOf(dot.tone), 1.5, dot.is_filled ? Qt::SolidLine : Qt::DashLine));
    painter.setBrush(dot.is_filled ? QBrush(colorOf(dot.tone)) : QBrush(Qt::NoBrush));
    painter.drawEllipse(paper.at(dot.at), dot.radius * paper.scale, dot.radius * paper.scale);
  }
  for (const Sketch::Label& label : sketch_.labels) {
    painter.setPen(colorOf(label.tone));
    const QPointF at = paper.at(label.at);
    painter.drawText(QRectF(at.x() - 80, at.y() - 10, 160, 20), Qt::AlignCenter, QString::fromStdString(label.text));
  }
}

}  // namespace fieldtrue::widgets
