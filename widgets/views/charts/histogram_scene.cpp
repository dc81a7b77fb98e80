#include "widgets/views/charts/histogram_scene.h"

#include <vtkAxis.h>
#include <vtkBrush.h>
#include <vtkChartLegend.h>
#include <vtkChartXY.h>
#include <vtkContextActor.h>
#include <vtkContextScene.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPen.h>
#include <vtkPlotBar.h>
#include <vtkRenderer.h>
#include <vtkStringArray.h>
#include <vtkTable.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/core/error.h"
#include "calib/core/number_text.h"
#include "widgets/views/host/mesh.h"
#include "widgets/views/host/overlay.h"
#include "widgets/views/host/scene_font.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kMostBins = 30;
constexpr int kTextSize = 12;
constexpr double kBarShare = 0.86;
constexpr double kHeadroom = 1.08;
constexpr double kGoldenAngle = 137.508;
constexpr double kFirstHue = 330.0;

int mostCounted(const Histogram& histogram) {
  int most = 1;
  for (const auto& counts : histogram.counts)
    if (!counts.empty()) most = std::max(most, *std::max_element(counts.begin(), counts.end()));
  return most;
}

std::array<unsigned char, 3> bytes(const QColor& color) {
  return {static_cast<unsigned char>(color.red()), static_cast<unsigned char>(color.green()),
          static_cast<unsigned char>(color.blue())};
}

}  // namespace

void setChartText(vtkTextProperty* text, const QColor& color, bool bold) {
  setFont(text, bold);
  text->SetFontSize(kTextSize);
  text->SetColor(rgb(color).data());
}

QColor seriesColor(std::size_t series, const Theme& theme) {
  if (series == 0) return theme.dark ? QColor(0x84, 0x91, 0x9e) : QColor(0x8b, 0x97, 0xa3);
  static const std::array<QRgb, 4> light = {0x0a63c2, 0x13744f, 0xc65a00, 0x8a4aa0};
  static const std::array<QRgb, 4> dark = {0x5aaeff, 0x4fc78f, 0xf59b4a, 0xd093e0};
  if (series <= light.size()) return QColor(theme.dark ? dark[series - 1] : light[series - 1]);
  // The golden angle keeps any number of hues apart; neighbours differ in lightness as well.
  const std::size_t k = series - 1 - light.size();
  const double hue = std::fmod(kFirstHue + kGoldenAngle * static_cast<double>(k), 360.0) / 360.0;
  const std::array<double, 3> lightness = theme.dark ? std::array{0.78, 0.62, 0.70} : std::array{0.27, 0.45, 0.36};
  return QColor::fromHslF(static_cast<float>(hue), 0.62F, static_cast<float>(lightness[k % lightness.size()]));
}

Histogram histogramOf(const std::vector<std::vector<double>>& values_mm) {
  double largest = 0.0;
  for (const auto& values : values_mm)
    for (const double value : values)
      if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  Histogram histogram;
  histogram.width_mm = largest > 0.0 ? roundStep(largest / kMostBins) : 1.0;
  const auto bins = static_cast<std::size_t>(std::floor(largest / histogram.width_mm)) + 1;
  for (const auto& values : values_mm) {
    std::vector<int>& counts = histogram.counts.emplace_back(bins, 0);
    for (const double value : values)
      if (std::isfinite(value)) ++counts[static_cast<std::size_t>(std::floor(std::abs(value) / histogram.width_mm))];
  }
  return histogram;
}

HistogramScene::HistogramScene(vtkRenderer* renderer)
    : renderer_(renderer), actor_(vtkSmartPointer<vtkContextActor>::New()), chart_(vtkSmartPointer<vtkChartXY>::New()) {
  actor_->GetScene()->SetRenderer(renderer);
  actor_->GetScene()->AddItem(chart_);
  renderer->AddActor(actor_);
}

HistogramScene::~HistogramScene() = default;

void HistogramScene::setSeries(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                               const QString& axis_title, const std::vector<std::size_t>& colors) {
  FT_CHECK(names.size() == values_mm.size() && (colors.empty() || colors.size() == names.size()));
  names_ = names;
  colors_ = colors;
  if (colors_.empty())
    for (std::size_t series = 0; series < names.size(); ++series) colors_.push_back(series);
  axis_title_ = axis_title;
  histogram_ = histogramOf(values_mm);
  changed_ = true;
}

void HistogramScene::setStyle(const Theme& theme, double ratio) {
  theme_ = &theme;
  ratio_ = ratio;
  changed_ = true;
}

void HistogramScene::update() {
  if (!changed_) return;
  changed_ = false;
  renderer_->SetBackground(rgb(theme_->surface).data());
  rebuild();
}

void HistogramScene::rebuild() {
  chart_->ClearPlots();
  const std::size_t bins = histogram_.counts.empty() ? 0 : histogram_.counts.front().size();
  for (std::size_t series = 0; series < names_.size(); ++series) {
    vtkNew<vtkTable> table;
    vtkNew<vtkDoubleArray> centers, counts;
    centers->SetName("center");
    counts->SetName("count");
    for (std::size_t bin = 0; bin < bins; ++bin) {
      centers->InsertNextValue((static_cast<double>(bin) + 0.5) * histogram_.width_mm);
      counts->InsertNextValue(histogram_.counts[series][bin]);
    }
    table->AddColumn(centers);
    table->AddColumn(counts);
    vtkPlot* bars = chart_->AddPlot(vtkChart::BAR);
    bars->SetInputData(table, 0, 1);
    bars->SetLabel(names_[series].toStdString());
    const auto [red, green, blue] = bytes(seriesColor(colors_[series], *theme_));
    bars->SetColor(red, green, blue, 255);
    bars->GetPen()->SetLineType(vtkPen::NO_PEN);
  }
  chart_->SetBarWidthFraction(static_cast<float>(kBarShare));
  chart_->SetShowLegend(names_.size() > 1);
  vtkChartLegend* legend = chart_->GetLegend();
  setChartText(legend->GetLabelProperties(), theme_->text);
  legend->SetSymbolWidth(static_cast<int>(14 * ratio_));
  legend->SetPadding(static_cast<int>(6 * ratio_));
  legend->GetPen()->SetLineType(vtkPen::NO_PEN);
  const auto [red, green, blue] = bytes(theme_->surface);
  legend->GetBrush()->SetColor(red, green, blue, 230);
  styleAxis(vtkAxis::BOTTOM, axis_title_);
  styleAxis(vtkAxis::LEFT, QStringLiteral("places"));
  const double width = histogram_.width_mm * static_cast<double>(std::max<std::size_t>(bins, 1));
  setTicks(vtkAxis::BOTTOM, width, roundStep(width / 8.0));
  const double most = mostCounted(histogram_);
  setTicks(vtkAxis::LEFT, kHeadroom * most, std::max(1.0, roundStep(most / 5.0)));
}

void HistogramScene::styleAxis(int axis, const QString& title) {
  vtkAxis* item = chart_->GetAxis(axis);
  setChartText(item->GetLabelProperties(), theme_->text_muted);
  setChartText(item->GetTitleProperties(), theme_->text, true);
  item->SetTitle(title.toStdString());
  const auto [red, green, blue] = bytes(theme_->line);
  for (vtkPen* pen : {item->GetPen(), item->GetGridPen()}) {
    pen->SetColor(red, green, blue);
    pen->SetWidth(static_cast<float>(ratio_));
  }
  item->SetGridVisible(axis == vtkAxis::LEFT);
}

void HistogramScene::setTicks(int axis, double maximum, double step) {
  vtkNew<vtkDoubleArray> positions;
  vtkNew<vtkStringArray> labels;
  for (int k = 0; k * step <= maximum * (1.0 + 1e-9); ++k) {
    positions->InsertNextValue(k * step);
    labels->InsertNextValue(shortNumber(k * step));
  }
  vtkAxis* item = chart_->GetAxis(axis);
  item->SetBehavior(vtkAxis::FIXED);
  item->SetRange(0.0, maximum);
  item->SetCustomTickPositions(positions, labels);
}

std::optional<QString> HistogramScene::textAt(double x_px) const {
  if (histogram_.counts.empty()) return std::nullopt;
  vtkAxis* axis = chart_->GetAxis(vtkAxis::BOTTOM);
  const double left = axis->GetPoint1()[0], right = axis->GetPoint2()[0];
  const std::size_t bins = histogram_.counts.front().size();
  const double along = (x_px - left) / (right - left) * static_cast<double>(bins);
  if (!(along >= 0.0 && along < static_cast<double>(bins))) return std::nullopt;
  const auto bin = static_cast<std::size_t>(along);
  const double low = static_cast<double>(bin) * histogram_.width_mm;
  QStringList lines = {QStringLiteral("%1 to %2 mm")
                           .arg(QString::fromStdString(shortNumber(low)),
                                QString::fromStdString(shortNumber(low + histogram_.width_mm)))};
  for (std::size_t series = 0; series < names_.size(); ++series) {
    const int count = histogram_.counts[series][bin];
    lines << QStringLiteral("%1: %2 %3").arg(names_[series]).arg(count).arg(count == 1 ? "place" : "places");
  }
  return lines.join(QLatin1Char('\n'));
}

}  // namespace fieldtrue::widgets
