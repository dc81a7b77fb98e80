#include "widgets/views/field/scale_strip.h"

#include <QPainter>
#include <algorithm>
#include <cmath>

#include "calib/core/number_text.h"
#include "widgets/style/color_scale.h"
#include "widgets/style/theme.h"
#include "widgets/views/field/field_scene.h"
#include "widgets/views/host/overlay.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kHeight = 44;
constexpr int kMargin = 12;
constexpr int kGap = 24;
constexpr int kBarTop = 8;
constexpr int kBarHeight = 12;
constexpr int kOpacityWidth = 124;
constexpr int kWidestBar = 420;
constexpr int kNarrowestBar = 60;
constexpr int kRoomForTicks = 200;

QString number(double value) { return QString::fromStdString(shortNumber(value)); }

}  // namespace

ScaleStrip::ScaleStrip(QWidget* parent) : QWidget(parent) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setAccessibleName(tr("Legend"));
  changed();
}

void ScaleStrip::setScale(Scale scale, double maximum_mm, bool exceeded) {
  scale_ = scale;
  maximum_mm_ = maximum_mm;
  exceeded_ = exceeded;
  changed();
}

void ScaleStrip::setEnds(const QString& low_name, const QString& high_name) {
  low_name_ = low_name;
  high_name_ = high_name;
  changed();
}

void ScaleStrip::setMeaning(const QString& meaning) {
  meaning_ = meaning;
  changed();
}

void ScaleStrip::setVolumeMeaning(const QString& meaning) {
  volume_meaning_ = meaning;
  changed();
}

void ScaleStrip::setMagnification(double magnification) {
  magnification_ = magnification;
  changed();
}

void ScaleStrip::setOpacityRange(const std::optional<OpacityRange>& range) {
  opacity_ = range;
  changed();
}

void ScaleStrip::changed() {
  setAccessibleDescription(text());
  setToolTip(text());
  update();
}

QString ScaleStrip::text() const {
  const QString more = exceeded_ ? tr(" and more") : QString();
  QString words = scale_ == Scale::kMagnitude
                      ? tr("Colours: %3 from 0 to %1 mm%2.").arg(number(maximum_mm_), more, meaning_)
                      : tr("Colours: from %1 better by %3 mm to %2 better by %3 mm%4.")
                            .arg(low_name_, high_name_, number(maximum_mm_), more);
  words += tr(" Arrows are drawn %1 times as long as they are.").arg(number(magnification_));
  if (opacity_)
    words += tr(" Faint arrows are uncertain: full colour up to an SD of %1 mm, faintest from %2 mm.")
                 .arg(number(opacity_->opaque_mm), number(opacity_->faint_mm));
  return words;
}

QSize ScaleStrip::sizeHint() const { return {600, kHeight}; }
QSize ScaleStrip::minimumSizeHint() const { return {280, kHeight}; }

int ScaleStrip::paintColors(QPainter& painter, Scale scale, const QString& title, int left, int width) const {
  const Theme& colors = theme();
  QFont bold = painter.font();
  bold.setBold(true);
  painter.setFont(bold);
  painter.setPen(colors.text);
  const int title_width = painter.fontMetrics().horizontalAdvance(title);
  painter.drawText(QRect(left, kBarTop - 3, title_width, kBarHeight + 6), Qt::AlignVCenter, title);
  bold.setBold(false);
  painter.setFont(bold);
  const int bar_left = left + title_width + 16;
  const int bar = std::clamp(width - title_width - 32, kNarrowestBar, kWidestBar);
  for (int x = 0; x < bar; ++x) {
    const double share = (x + 0.5) / bar;
    painter.fillRect(bar_left + x, kBarTop, 1, kBarHeight,
                     scale == Scale::kDifference ? differenceColor(2.0 * share - 1.0) : magnitudeColor(share));
  }
  painter.setPen(colors.line);
  painter.drawRect(bar_left, kBarTop, bar - 1, kBarHeight - 1);
  paintTicks(painter, scale, bar_left, bar);
  return bar_left + bar;
}

void ScaleStrip::paintTicks(QPainter& painter, Scale scale, int bar_left, int bar) const {
  const Theme& colors = theme();
  const auto tick = [&](double share, const QString& label) {
    const int x = bar_left + static_cast<int>(share * (bar - 1));
    painter.setPen(colors.text_muted);
    painter.drawLine(x, kBarTop + kBarHeight, x, kBarTop + kBarHeight + 3);
    painter.setPen(colors.text);
    painter.drawText(QRect(x - 60, kBarTop + kBarHeight + 3, 120, 18), Qt::AlignHCenter | Qt::AlignTop, label);
  };
  const QString end = number(maximum_mm_) + (exceeded_ ? QStringLiteral("+") : QString());
  if (scale == Scale::kMagnitude && bar < kRoomForTicks) {
    tick(0.0, QStringLiteral("0"));
    tick(1.0, end);
    return;
  }
  if (scale == Scale::kMagnitude) {
    for (const double value : scaleTicks(maximum_mm_))
      tick(value / maximum_mm_, value == maximum_mm_ ? end : number(value));
    return;
  }
  tick(0.0, end);
  tick(0.5, QStringLiteral("0"));
  tick(1.0, end);
  const int half = bar / 2 - 36;
  const QFontMetrics metrics = painter.fontMetrics();
  painter.setPen(colors.text_muted);
  painter.drawText(QRect(bar_left + 22, kBarTop + kBarHeight + 3, half, 18), Qt::AlignLeft | Qt::AlignTop,
                   metrics.elidedText(low_name_, Qt::ElideRight, half));
  painter.drawText(QRect(bar_left + bar - 22 - half, kBarTop + kBarHeight + 3, half, 18), Qt::AlignRight | Qt::AlignTop,
                   metrics.elidedText(high_name_, Qt::ElideRight, half));
}

void ScaleStrip::paintOpacity(QPainter& painter, int left, int width) const {
  const Theme& colors = theme();
  for (int x = 0; x < width; ++x) {
    const double uncertainty_mm =
        opacity_->opaque_mm + (opacity_->faint_mm - opacity_->opaque_mm) * x / static_cast<double>(width);
    QColor color = colors.text;
    color.setAlpha(static_cast<int>(std::lround(255.0 * opacityOf(uncertainty_mm, *opacity_))));
    painter.fillRect(left + x, kBarTop, 1, kBarHeight, color);
  }
  painter.setPen(colors.text);
  painter.drawText(QRect(left - 20, kBarTop + kBarHeight + 3, width + 40, 18), Qt::AlignHCenter | Qt::AlignTop,
                   tr("SD %1 to %2 mm").arg(number(opacity_->opaque_mm), number(opacity_->faint_mm)));
}

void ScaleStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  const Theme& colors = theme();
  const QString arrows = tr("arrows \u00d7%1").arg(number(magnification_));
  const int arrows_width = painter.fontMetrics().horizontalAdvance(arrows);
  const int right = width() - kMargin - arrows_width;
  painter.setPen(colors.text);
  painter.drawText(QRect(right, kBarTop - 3, arrows_width, kBarHeight + 6), Qt::AlignVCenter, arrows);
  const int opacity_room = opacity_ ? kOpacityWidth + kGap + 16 : 0;
  const int room = right - kGap - opacity_room - kMargin;
  const QString title = scale_ == Scale::kDifference ? tr("difference (mm)") : tr("%1 (mm)").arg(meaning_);
  const bool two = scale_ == Scale::kDifference && !volume_meaning_.isEmpty();
  const int bar_end = paintColors(painter, scale_, title, kMargin, two ? room / 2 : room);
  if (two)
    paintColors(painter, Scale::kMagnitude, tr("%1 (mm)").arg(volume_meaning_), bar_end + kGap, room - bar_end - kGap);
  if (opacity_) paintOpacity(painter, bar_end + kGap + 8, kOpacityWidth);
}

}  // namespace fieldtrue::widgets
