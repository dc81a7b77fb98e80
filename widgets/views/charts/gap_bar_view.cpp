#include "widgets/views/charts/gap_bar_view.h"

#include <QPainter>
#include <algorithm>

#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kBarHeight = 12;
constexpr int kGap = 8;
constexpr int kUsualWidth = 320;
constexpr int kNarrowest = 200;
constexpr int kWrapped = Qt::AlignLeft | Qt::AlignTop | Qt::TextWordWrap;

QFont boldOf(QFont font) {
  font.setBold(true);
  return font;
}

}  // namespace

GapBarView::GapBarView(QWidget* parent) : QWidget(parent) {
  QSizePolicy policy(QSizePolicy::Expanding, QSizePolicy::Minimum);
  policy.setHeightForWidth(true);
  setSizePolicy(policy);
}

void GapBarView::setChart(const GapBarChart& chart) {
  chart_ = chart;
  setObjectName(QStringLiteral("chart_") + QString::fromStdString(chart_.id));
  QString words = QString::fromStdString(chart_.title);
  for (const GapBar& bar : chart_.bars) words += QString::fromStdString("; " + bar.name + " " + bar.text);
  setAccessibleName(words);
  updateGeometry();
  update();
}

int GapBarView::noteHeight(const GapBar& bar, int width) const {
  if (bar.note.empty()) return 0;
  return fontMetrics().boundingRect(QRect(0, 0, width, 1000), kWrapped, QString::fromStdString(bar.note)).height();
}

int GapBarView::rowHeight(const GapBar& bar, int width) const {
  return fontMetrics().height() + kBarHeight + kGap + noteHeight(bar, width);
}

int GapBarView::titleHeight(int width) const {
  const QFontMetrics metrics(boldOf(font()));
  return metrics.boundingRect(QRect(0, 0, width, 1000), kWrapped, QString::fromStdString(chart_.title)).height();
}

int GapBarView::heightForWidth(int width) const {
  int height = titleHeight(width) + kGap;
  for (const GapBar& bar : chart_.bars) height += rowHeight(bar, width);
  return height;
}

QSize GapBarView::minimumSizeHint() const { return {kNarrowest, sizeHint().height()}; }

QSize GapBarView::sizeHint() const { return {kUsualWidth, heightForWidth(std::max(width(), kUsualWidth))}; }

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
  painter.drawText(QRect(0, top + line + kBarHeight, width(), noteHeight(bar, width())), kWrapped,
                   QString::fromStdString(bar.note));
}

void GapBarView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const int title_height = titleHeight(width());
  painter.setFont(boldOf(font()));
  painter.setPen(theme().text);
  painter.drawText(QRect(0, 0, width(), title_height), kWrapped, QString::fromStdString(chart_.title));
  painter.setFont(font());
  int top = title_height + kGap;
  for (const GapBar& bar : chart_.bars) {
    drawBar(painter, bar, top);
    top += rowHeight(bar, width());
  }
}

}  // namespace fieldtrue::widgets
