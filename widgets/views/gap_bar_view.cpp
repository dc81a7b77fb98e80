#include "widgets/views/gap_bar_view.h"

#include <QPainter>
#include <algorithm>

#include "widgets/views/theme.h"

namespace fieldtrue {
namespace {

constexpr int kBarHeight = 12;
constexpr int kGap = 8;

}  // namespace

GapBarView::GapBarView(QWidget* parent) : QWidget(parent) { setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed); }

void GapBarView::setChart(const GapBarChart& chart) {
  chart_ = chart;
  setObjectName(QStringLiteral("chart_") + QString::fromStdString(chart_.id));
  QString words = QString::fromStdString(chart_.title);
  for (const GapBar& bar : chart_.bars) words += QString::fromStdString("; " + bar.name + " " + bar.text);
  setAccessibleName(words);
  updateGeometry();
  update();
}

int GapBarView::rowHeight(const GapBar& bar) const {
  const int line = fontMetrics().height();
  return line + kBarHeight + kGap + (bar.note.empty() ? 0 : line);
}

QSize GapBarView::sizeHint() const {
  int height = fontMetrics().height() + kGap;
  for (const GapBar& bar : chart_.bars) height += rowHeight(bar);
  return {320, height + kGap};
}

void GapBarView::drawBar(QPainter& painter, const GapBar& bar, int top) const {
  const Theme& colors = theme();
  const int line = fontMetrics().height();
  const QRect words(0, top, width(), line);
  const QString value = QString::fromStdString(bar.text);
  const int left_for_name = width() - fontMetrics().horizontalAdvance(value) - kGap;
  painter.setPen(bar.muted ? colors.text_muted : colors.text);
  painter.drawText(words, Qt::AlignLeft,
                   fontMetrics().elidedText(QString::fromStdString(bar.name), Qt::ElideRight, left_for_name));
  painter.drawText(words, Qt::AlignRight, value);
  const double scale = (width() - 2) / chart_.maximum();
  const QRectF track(0, top + line + 2, width(), kBarHeight - 2);
  painter.fillRect(track, colors.background);
  painter.fillRect(QRectF(0, track.top(), scale * bar.value, track.height()), bar.muted ? colors.line : colors.accent);
  painter.setPen(QPen(colors.text, 1.5));
  if (bar.low90 && bar.high90) {
    const double low = scale * std::max(0.0, *bar.low90);
    const double high = scale * *bar.high90;
    painter.drawLine(QPointF(low, track.center().y()), QPointF(high, track.center().y()));
    for (const double x : {low, high}) painter.drawLine(QPointF(x, track.top() + 2), QPointF(x, track.bottom() - 2));
  }
  if (bar.floor)
    painter.drawLine(QPointF(scale * *bar.floor, track.top() - 2), QPointF(scale * *bar.floor, track.bottom() + 2));
  if (bar.note.empty()) return;
  painter.setPen(colors.text_muted);
  painter.drawText(QRect(0, top + line + kBarHeight, width(), line), Qt::AlignLeft,
                   fontMetrics().elidedText(QString::fromStdString(bar.note), Qt::ElideRight, width()));
}

void GapBarView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  QFont bold = font();
  bold.setBold(true);
  painter.setFont(bold);
  painter.setPen(theme().text);
  painter.drawText(QRect(0, 0, width(), fontMetrics().height()), Qt::AlignLeft,
                   QFontMetrics(bold).elidedText(QString::fromStdString(chart_.title), Qt::ElideRight, width()));
  painter.setFont(font());
  int top = fontMetrics().height() + kGap;
  for (const GapBar& bar : chart_.bars) {
    drawBar(painter, bar, top);
    top += rowHeight(bar);
  }
}

}  // namespace fieldtrue
