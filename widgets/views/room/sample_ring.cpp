#include "widgets/views/room/sample_ring.h"

#include <QPainter>
#include <QVariantAnimation>
#include <algorithm>

#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

/// A take that would need more is not expected to come to an end by itself.
constexpr int kMostForeseen = 100000;
constexpr int kFlash_ms = 450;
constexpr double kThickness = 0.13;  ///< Of the ring's diameter.
constexpr double kLetters = 0.27;    ///< The same, of the number within; less for many digits.
constexpr double kWidest = 0.62;     ///< The same, of that number: wider it would reach into the ring.
constexpr int kTop = 90 * 16;        ///< Qt counts sixteenths of a degree from three o'clock.

}  // namespace

SampleRing::SampleRing(QWidget* parent) : QWidget(parent) {
  setAccessibleName(tr("Samples taken at this place"));
  flashing_ = new QVariantAnimation(this);
  flashing_->setDuration(kFlash_ms);
  flashing_->setStartValue(1.0);
  flashing_->setEndValue(0.0);
  connect(flashing_, &QVariantAnimation::valueChanged, this, [this](const QVariant& value) {
    flash_ = value.toDouble();
    update();
  });
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, this, [this] { update(); });
}

void SampleRing::setProgress(int collected, int wanted, State state) {
  if (collected == collected_ && wanted == wanted_ && state == state_) return;
  if (state == State::kDone && state_ != State::kDone) flashing_->start();
  collected_ = collected;
  wanted_ = std::max(wanted, 1);
  state_ = state;
  setAccessibleDescription(tr("%1 of %2 samples").arg(collected_).arg(wanted_));
  update();
}

QSize SampleRing::sizeHint() const { return {96, 96}; }

QSize SampleRing::minimumSizeHint() const { return {40, 40}; }

QColor SampleRing::color() const {
  switch (state_) {
    case State::kDone:
      return theme().done;
    case State::kFailed:
      return theme().attention;
    case State::kIdle:
    case State::kCollecting:
      break;
  }
  return theme().accent;
}

void SampleRing::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const double side = std::min(width(), height());
  const double thickness = kThickness * side;
  const QRectF outline =
      QRectF(0.5 * (width() - side), 0.5 * (height() - side), side, side)
          .adjusted(0.5 * thickness + 1, 0.5 * thickness + 1, -0.5 * thickness - 1, -0.5 * thickness - 1);
  if (flash_ > 0.0) {
    QColor glow = color();
    glow.setAlphaF(static_cast<float>(0.6 * flash_));
    painter.setPen(Qt::NoPen);
    painter.setBrush(glow);
    painter.drawEllipse(outline);
    painter.setBrush(Qt::NoBrush);
  }
  painter.setPen(QPen(theme().line, thickness));
  painter.drawEllipse(outline);
  const double share = state_ == State::kDone ? 1.0 : std::clamp(static_cast<double>(collected_) / wanted_, 0.0, 1.0);
  if (share > 0.0) {
    painter.setPen(QPen(color(), thickness, Qt::SolidLine, Qt::FlatCap));
    painter.drawArc(outline, kTop, -static_cast<int>(share * 360 * 16));
  }
  QFont large = font();
  large.setBold(true);
  const QString number = QString::number(collected_);
  large.setPixelSize(std::max(10, static_cast<int>(kLetters * side)));
  const double share_of_room = kWidest * side / QFontMetricsF(large).horizontalAdvance(number);
  if (share_of_room < 1.0) large.setPixelSize(std::max(8, static_cast<int>(share_of_room * kLetters * side)));
  painter.setFont(large);
  painter.setPen(state_ == State::kFailed ? theme().attention : theme().text);
  const double below = 0.14 * side;
  painter.drawText(outline.translated(0, -0.06 * side), Qt::AlignCenter, number);
  QFont small = font();
  small.setPixelSize(std::max(8, static_cast<int>(0.12 * side)));
  painter.setFont(small);
  painter.setPen(theme().text_muted);
  const QString of = wanted_ > kMostForeseen ? tr("so far") : tr("of %1").arg(wanted_);
  painter.drawText(outline.translated(0, below), Qt::AlignCenter, of);
}

}  // namespace fieldtrue::widgets
