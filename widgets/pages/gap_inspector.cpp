#include "widgets/pages/gap_inspector.h"

#include <QLabel>
#include <QVBoxLayout>

#include "widgets/figures/gap_bars.h"
#include "widgets/views/charts/gap_bar_view.h"

namespace fieldtrue::widgets {

GapInspector::GapInspector(QWidget* parent) : QScrollArea(parent), charts_(new QWidget(this)) {
  setWidgetResizable(true);
  setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  setMinimumWidth(320);
  layout_ = new QVBoxLayout(charts_);
  layout_->setContentsMargins(12, 12, 12, 12);
  layout_->setSpacing(16);
  setWidget(charts_);
  setObjectName(QStringLiteral("inspector"));
}

void GapInspector::setReport(const std::optional<gap::GapReport>& report) {
  while (QLayoutItem* item = layout_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  if (!report) return;
  for (const GapBarChart& chart : gapCharts(*report)) {
    auto* view = new GapBarView(charts_);
    view->setChart(chart);
    layout_->addWidget(view);
  }
  addText("gapHowFarOff", QString::fromStdString(gap::howFarOffText(*report)));
  if (report->replicates) addText("gapTrust", QString::fromStdString(report->replicates->text));
  const std::string prediction = predictionText(*report);
  if (!prediction.empty()) addText("gapPrediction", tr("To be checked: %1").arg(QString::fromStdString(prediction)));
  for (const recording::GapFinding& finding : report->findings)
    addText("gapFinding", QString::fromStdString(finding.text));
  layout_->addStretch(1);
  layout_->activate();
}

void GapInspector::addText(const char* name, const QString& words) {
  auto* label = new QLabel(words, charts_);
  label->setObjectName(QLatin1String(name));
  label->setWordWrap(true);
  label->setTextInteractionFlags(Qt::TextSelectableByMouse);
  layout_->addWidget(label);
}

}  // namespace fieldtrue::widgets
