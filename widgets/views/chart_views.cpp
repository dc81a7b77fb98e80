#include "widgets/views/chart_views.h"

#include <QMouseEvent>
#include <QToolTip>

#include "widgets/views/histogram_scene.h"
#include "widgets/views/theme.h"

namespace fieldtrue {

HistogramView::HistogramView(QWidget* parent) : VtkHost(parent), scene_(std::make_unique<HistogramScene>(renderer())) {
  setAccessibleName(tr("Histogram of the errors"));
}

HistogramView::~HistogramView() = default;

void HistogramView::setSeries(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                              const QString& axis_title) {
  scene_->setSeries(names, values_mm, axis_title);
  requestRender();
}

void HistogramView::restyle(double pixel_ratio) { scene_->setStyle(theme(), pixel_ratio); }

void HistogramView::prepareFrame() { scene_->update(); }

void HistogramView::mouseMoveEvent(QMouseEvent* event) {
  if (const auto text = scene_->textAt(event->position().x() * pixelRatio()))
    QToolTip::showText(event->globalPosition().toPoint(), *text, this);
  else
    QToolTip::hideText();
}

void HistogramView::leaveEvent(QEvent*) { QToolTip::hideText(); }

}  // namespace fieldtrue
