#include "widgets/views/charts/chart_views.h"

#include <QMouseEvent>
#include <QToolTip>

#include "widgets/style/theme.h"
#include "widgets/views/charts/curve_scene.h"
#include "widgets/views/charts/histogram_scene.h"

namespace fieldtrue::widgets {

HistogramView::HistogramView(QWidget* parent) : VtkHost(parent), scene_(std::make_unique<HistogramScene>(renderer())) {
  setAccessibleName(tr("Histogram of the errors"));
}

HistogramView::~HistogramView() = default;

void HistogramView::setSeries(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                              const QString& axis_title, const std::vector<std::size_t>& colors) {
  scene_->setSeries(names, values_mm, axis_title, colors);
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

CurveView::CurveView(QWidget* parent) : VtkHost(parent), scene_(std::make_unique<CurveScene>(renderer())) {
  setAccessibleName(tr("Learning curves"));
}

CurveView::~CurveView() = default;

void CurveView::setLines(const std::vector<ChartLine>& lines, const QString& x_title, const QString& y_title) {
  scene_->setLines(lines, x_title, y_title);
  requestRender();
}

const std::vector<ChartLine>& CurveView::lines() const { return scene_->lines(); }

void CurveView::restyle(double pixel_ratio) { scene_->setStyle(theme(), pixel_ratio); }

void CurveView::prepareFrame() { scene_->update(); }

void CurveView::mouseMoveEvent(QMouseEvent* event) {
  const QPointF at = event->position() * pixelRatio();
  if (const auto text = scene_->textAt(at.x(), height() * pixelRatio() - at.y()))
    QToolTip::showText(event->globalPosition().toPoint(), *text, this);
  else
    QToolTip::hideText();
}

void CurveView::leaveEvent(QEvent*) { QToolTip::hideText(); }

}  // namespace fieldtrue::widgets
