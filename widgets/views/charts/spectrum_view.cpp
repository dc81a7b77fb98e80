#include "widgets/views/charts/spectrum_view.h"

#include <QPainter>
#include <algorithm>
#include <cmath>

#include "widgets/style/theme.h"
#include "widgets/views/charts/curve_scene.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kLeastPower = 1e-3;

}  // namespace

SpectrumView::SpectrumView(QWidget* parent) : QWidget(parent) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Expanding);
  setMinimumHeight(140);
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, this, qOverload<>(&QWidget::update));
}

void SpectrumView::setSpectrum(const std::optional<recording::SampleSpectrum>& spectrum) {
  spectrum_ = spectrum;
  QString words = spectrum_ ? tr("Spectrum of the noise") : tr("No spectrum yet");
  if (spectrum_) {
    for (const recording::SpectralLine& line : spectrum_->lines)
      words += tr("; a line at %1 Hz").arg(line.frequency_hz, 0, 'f', 1);
  }
  setAccessibleName(words);
  setToolTip(words);
  update();
}

void SpectrumView::drawAxes(QPainter& painter, const QRectF& box, double low, double high) const {
  painter.setPen(theme().line);
  painter.drawRect(box);
  for (const double tick : logTicks(low, high)) {
    if (tick < low || tick > high) continue;
    const double y = box.bottom() - box.height() * std::log(tick / low) / std::log(high / low);
    painter.setPen(theme().line);
    painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y));
    painter.setPen(theme().text_muted);
    painter.drawText(QRectF(0, y - 10, box.left() - 6, 20), Qt::AlignRight | Qt::AlignVCenter, QString::number(tick));
  }
  painter.setPen(theme().text_muted);
  const double most_hz = 0.5 * spectrum_->rate_hz;
  for (int quarter = 0; quarter <= 4; ++quarter) {
    const double x = box.left() + box.width() * quarter / 4.0;
    painter.drawText(QRectF(x - 30, box.bottom() + 2, 60, 16), Qt::AlignCenter,
                     QString::number(most_hz * quarter / 4.0, 'g', 3) + (quarter == 4 ? tr(" Hz") : QString()));
  }
}

void SpectrumView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  if (!spectrum_ || spectrum_->power.empty()) {
    painter.setPen(theme().text_muted);
    painter.drawText(rect(), Qt::AlignCenter | Qt::TextWordWrap, tr("Let the sensor lie for a few seconds."));
    return;
  }
  const QRectF box(46, 18, width() - 76, height() - 40);
  const double high = 1.5 * *std::max_element(spectrum_->power.begin(), spectrum_->power.end());
  const double low = std::max(kLeastPower, 0.5 * *std::min_element(spectrum_->power.begin(), spectrum_->power.end()));
  if (high <= low) return;
  drawAxes(painter, box, low, high);
  const auto at = [&](double frequency_hz, double power) {
    return QPointF(box.left() + box.width() * frequency_hz / (0.5 * spectrum_->rate_hz),
                   box.bottom() - box.height() * std::log(std::max(power, low) / low) / std::log(high / low));
  };
  const auto draw = [&](const std::vector<double>& powers, const QPen& pen) {
    QPolygonF points;
    for (std::size_t i = 0; i < powers.size(); ++i) {
      if (powers[i] > 0.0) points << at(spectrum_->frequencies_hz[i], powers[i]);
    }
    painter.setPen(pen);
    painter.drawPolyline(points);
  };
  draw(spectrum_->background, QPen(theme().text_muted, 1.5, Qt::DashLine));
  draw(spectrum_->power, QPen(theme().accent, 1.5));
  painter.setPen(theme().attention);
  for (const recording::SpectralLine& line : spectrum_->lines) {
    const QPointF top = at(line.frequency_hz, high);
    painter.drawLine(top, QPointF(top.x(), box.bottom()));
    painter.drawText(QRectF(top.x() - 40, 0, 80, 16), Qt::AlignCenter, tr("%1 Hz").arg(line.frequency_hz, 0, 'f', 1));
  }
}

}  // namespace fieldtrue::widgets
