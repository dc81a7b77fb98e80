#pragma once

#include <QWidget>
#include <optional>

#include "calib/recording/sample_spectrum.h"

namespace fieldtrue::widgets {

/// The power of a sensor's noise by frequency, logarithmic, over its background; lines that stand out are named.
class SpectrumView : public QWidget {
  Q_OBJECT
 public:
  explicit SpectrumView(QWidget* parent = nullptr);
  void setSpectrum(const std::optional<recording::SampleSpectrum>& spectrum);
  QSize sizeHint() const override { return {340, 220}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  void drawAxes(QPainter& painter, const QRectF& box, double low, double high) const;
  std::optional<recording::SampleSpectrum> spectrum_;
};

}  // namespace fieldtrue::widgets
