#include "widgets/views/charts/curve_scene.h"

#include <vtkAxis.h>
#include <vtkChartXY.h>
#include <vtkContext2D.h>
#include <vtkContextActor.h>
#include <vtkContextItem.h>
#include <vtkContextScene.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkPlotPoints.h>
#include <vtkRenderer.h>
#include <vtkStdString.h>
#include <vtkStringArray.h>
#include <vtkTable.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/number_text.h"
#include "widgets/figures/scene_space.h"
#include "widgets/views/charts/histogram_scene.h"
#include "widgets/views/host/mesh.h"
#include "widgets/views/host/overlay.h"
#include "widgets/views/host/scene_font.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kLetter_px = 6.9;  ///< Mean width of a bold letter.
constexpr double kMostLabelShare = 0.45;
constexpr std::size_t kFewestLetters = 8;
constexpr double kLabelGap_px = 16.0;
constexpr double kPick_px = 14.0;
constexpr double kLine_px = 2.0;
constexpr float kMarker_px = 6.0F;

struct Bounds {
  double x_low = 0.0, x_high = 1.0, y_low = 1.0, y_high = 10.0;
};

bool drawable(const ChartPoint& point) { return std::isfinite(point.x) && std::isfinite(point.y) && point.y > 0.0; }

Bounds boundsOf(const std::vector<ChartLine>& lines) {
  Bounds bounds;
  bool first = true;
  for (const ChartLine& line : lines) {
    for (const ChartPoint& point : line.points) {
      if (!drawable(point)) continue;
      if (first) bounds = {0.0, point.x, point.y, point.y};
      first = false;
      bounds.x_high = std::max(bounds.x_high, point.x);
      bounds.y_low = std::min(bounds.y_low, point.y);
      bounds.y_high = std::max(bounds.y_high, point.y);
    }
  }
  bounds.y_low /= 1.3;
  bounds.y_high *= 1.3;
  bounds.x_high *= 1.03;
  return bounds;
}

}  // namespace

/// Names at the lines' ends and whiskers at their points, drawn above the chart.
class CurveLabels : public vtkContextItem {
 public:
  static CurveLabels* New();
  bool Paint(vtkContext2D* painter) override;

  vtkChartXY* chart = nullptr;
  const std::vector<ChartLine>* lines = nullptr;
  const Theme* theme = &Theme::of(false);
  double ratio = 1.0;
  std::size_t letters = 20;  ///< Room for a name; longer ones are cut.

  /// Where a point stands in the picture [device pixels from the lower left corner].
  std::array<double, 2> toPixels(double x, double y) const;

 protected:
  CurveLabels() = default;

 private:
  void paintWhiskers(vtkContext2D* painter) const;
  void paintNames(vtkContext2D* painter) const;
  QString cut(const QString& name) const;
};

vtkStandardNewMacro(CurveLabels);

std::array<double, 2> CurveLabels::toPixels(double x, double y) const {
  const auto along = [](vtkAxis* axis, double value, int coordinate) {
    const double share = (value - axis->GetMinimum()) / (axis->GetMaximum() - axis->GetMinimum());
    return axis->GetPoint1()[coordinate] + share * (axis->GetPoint2()[coordinate] - axis->GetPoint1()[coordinate]);
  };
  return {along(chart->GetAxis(vtkAxis::BOTTOM), x, 0), along(chart->GetAxis(vtkAxis::LEFT), std::log10(y), 1)};
}

bool CurveLabels::Paint(vtkContext2D* painter) {
  if (chart == nullptr || lines == nullptr || lines->empty()) return true;
  paintWhiskers(painter);
  paintNames(painter);
  return true;
}

void CurveLabels::paintWhiskers(vtkContext2D* painter) const {
  const double lowest = std::pow(10.0, chart->GetAxis(vtkAxis::LEFT)->GetMinimum());
  const double highest = std::pow(10.0, chart->GetAxis(vtkAxis::LEFT)->GetMaximum());
  for (const ChartLine& line : *lines) {
    const QColor color = seriesColor(line.color, *theme);
    painter->GetPen()->SetLineType(vtkPen::SOLID_LINE);
    painter->GetPen()->SetColorF(color.redF(), color.greenF(), color.blueF(), 0.55);
    painter->GetPen()->SetWidth(static_cast<float>(ratio));
    for (const ChartPoint& point : line.points) {
      if (!drawable(point) || !(point.high > point.low)) continue;
      const auto low = toPixels(point.x, std::clamp(point.low, lowest, highest));
      const auto high = toPixels(point.x, std::clamp(point.high, lowest, highest));
      painter->DrawLine(static_cast<float>(low[0]), static_cast<float>(low[1]), static_cast<float>(high[0]),
                        static_cast<float>(high[1]));
    }
  }
}

void CurveLabels::paintNames(vtkContext2D* painter) const {
  std::vector<std::size_t> shown;
  std::vector<double> wanted;
  for (std::size_t k = 0; k < lines->size(); ++k) {
    const auto& points = (*lines)[k].points;
    const auto last = std::find_if(points.rbegin(), points.rend(), drawable);
    if (last == points.rend()) continue;
    shown.push_back(k);
    wanted.push_back(toPixels(last->x, last->y)[1]);
  }
  vtkAxis* left = chart->GetAxis(vtkAxis::LEFT);
  const std::vector<double> heights =
      spreadLabels(wanted, kLabelGap_px * ratio, left->GetPoint1()[1] + 4.0 * ratio, left->GetPoint2()[1]);
  const double x = chart->GetAxis(vtkAxis::BOTTOM)->GetPoint2()[0] + 6.0 * ratio;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    vtkTextProperty* text = painter->GetTextProp();
    setChartText(text, seriesColor((*lines)[shown[k]].color, *theme), true);
    text->SetOpacity(1.0);
    text->SetJustificationToLeft();
    text->SetVerticalJustificationToCentered();
    painter->DrawString(static_cast<float>(x), static_cast<float>(heights[k]),
                        vtkStdString(cut((*lines)[shown[k]].name).toStdString()));
  }
}

QString CurveLabels::cut(const QString& name) const {
  const auto room = static_cast<qsizetype>(letters);
  return name.size() <= room ? name : name.left(room - 1).trimmed() + QChar(0x2026);
}

std::vector<double> logTicks(double low, double high) {
  std::vector<double> ticks;
  for (int power = static_cast<int>(std::floor(std::log10(low))); std::pow(10.0, power) <= high; ++power)
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double tick = digit * std::pow(10.0, power);
      if (tick >= low * (1.0 - 1e-9) && tick <= high * (1.0 + 1e-9)) ticks.push_back(tick);
    }
  if (ticks.size() < 2) ticks = {low, high};
  return ticks;
}

std::vector<double> spreadLabels(std::vector<double> wanted, double gap, double low, double high) {
  std::vector<std::size_t> order(wanted.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return wanted[a] < wanted[b]; });
  // Upwards each keeps clear of the one below; then those pushed out at the top come down again.
  double free_from = low;
  for (const std::size_t k : order) {
    wanted[k] = std::max(wanted[k], free_from);
    free_from = wanted[k] + gap;
  }
  double free_to = high;
  for (auto k = order.rbegin(); k != order.rend(); ++k) {
    wanted[*k] = std::min(wanted[*k], free_to);
    free_to = wanted[*k] - gap;
  }
  return wanted;
}

CurveScene::CurveScene(vtkRenderer* renderer)
    : renderer_(renderer),
      actor_(vtkSmartPointer<vtkContextActor>::New()),
      chart_(vtkSmartPointer<vtkChartXY>::New()),
      labels_(vtkSmartPointer<CurveLabels>::New()) {
  chart_->SetAutoSize(false);
  chart_->SetLayoutStrategy(vtkChart::FILL_RECT);
  chart_->SetShowLegend(false);
  labels_->chart = chart_;
  labels_->lines = &lines_;
  actor_->GetScene()->SetRenderer(renderer);
  actor_->GetScene()->AddItem(chart_);
  actor_->GetScene()->AddItem(labels_);
  renderer->AddActor(actor_);
}

CurveScene::~CurveScene() {
  labels_->chart = nullptr;
  labels_->lines = nullptr;
}

void CurveScene::setLines(const std::vector<ChartLine>& lines, const QString& x_title, const QString& y_title) {
  lines_ = lines;
  x_title_ = x_title;
  y_title_ = y_title;
  changed_ = true;
}

void CurveScene::setStyle(const Theme& theme, double ratio) {
  theme_ = &theme;
  ratio_ = ratio;
  changed_ = true;
}

void CurveScene::fillSize() {
  const int* size = renderer_->GetSize();
  qsizetype letters = 0;
  for (const ChartLine& line : lines_) letters = std::max(letters, line.name.size());
  const double room_px = std::min(kMostLabelShare * size[0] / ratio_, kLetter_px * static_cast<double>(letters) + 12.0);
  labels_->letters = std::max(kFewestLetters, static_cast<std::size_t>(std::max(0.0, room_px - 12.0) / kLetter_px));
  const auto width = static_cast<float>(std::max(60.0, size[0] - room_px * ratio_));
  chart_->SetSize(vtkRectf(0.0F, 0.0F, width, static_cast<float>(size[1])));
}

void CurveScene::update() {
  fillSize();
  if (!changed_) return;
  changed_ = false;
  renderer_->SetBackground(rgb(theme_->surface).data());
  labels_->theme = theme_;
  labels_->ratio = ratio_;
  rebuild();
}

void CurveScene::rebuild() {
  chart_->ClearPlots();
  for (const ChartLine& line : lines_) {
    vtkNew<vtkTable> table;
    vtkNew<vtkDoubleArray> xs, ys;
    xs->SetName("x");
    ys->SetName("y");
    for (const ChartPoint& point : line.points) {
      if (!drawable(point)) continue;
      xs->InsertNextValue(point.x);
      ys->InsertNextValue(std::log10(point.y));
    }
    if (xs->GetNumberOfTuples() == 0) continue;
    table->AddColumn(xs);
    table->AddColumn(ys);
    auto* plot = vtkPlotPoints::SafeDownCast(chart_->AddPlot(vtkChart::LINE));
    plot->SetInputData(table, 0, 1);
    const QColor color = seriesColor(line.color, *theme_);
    plot->SetColor(static_cast<unsigned char>(color.red()), static_cast<unsigned char>(color.green()),
                   static_cast<unsigned char>(color.blue()), 255);
    plot->SetWidth(static_cast<float>(kLine_px * ratio_));
    plot->SetMarkerStyle(vtkPlotPoints::CIRCLE);
    plot->SetMarkerSize(kMarker_px * static_cast<float>(ratio_));
  }
  const Bounds bounds = boundsOf(lines_);
  std::vector<double> xs;
  const double step = roundStep(bounds.x_high / 6.0);
  for (int k = 0; k * step <= bounds.x_high; ++k) xs.push_back(k * step);
  styleAxis(vtkAxis::BOTTOM, x_title_, xs, false);
  styleAxis(vtkAxis::LEFT, y_title_, logTicks(bounds.y_low, bounds.y_high), true);
  chart_->GetAxis(vtkAxis::BOTTOM)->SetRange(bounds.x_low, bounds.x_high);
  chart_->GetAxis(vtkAxis::LEFT)->SetRange(std::log10(bounds.y_low), std::log10(bounds.y_high));
}

void CurveScene::styleAxis(int axis, const QString& title, const std::vector<double>& ticks, bool logarithmic) {
  vtkAxis* item = chart_->GetAxis(axis);
  vtkNew<vtkDoubleArray> positions;
  vtkNew<vtkStringArray> names;
  for (const double tick : ticks) {
    positions->InsertNextValue(logarithmic ? std::log10(tick) : tick);
    names->InsertNextValue(shortNumber(tick));
  }
  item->SetBehavior(vtkAxis::FIXED);
  item->SetCustomTickPositions(positions, names);
  setChartText(item->GetLabelProperties(), theme_->text_muted);
  setChartText(item->GetTitleProperties(), theme_->text, true);
  item->SetTitle(title.toStdString());
  for (vtkPen* pen : {item->GetPen(), item->GetGridPen()}) {
    pen->SetColorF(theme_->line.redF(), theme_->line.greenF(), theme_->line.blueF());
    pen->SetWidth(static_cast<float>(ratio_));
  }
  item->SetGridVisible(axis == vtkAxis::LEFT);
}

std::optional<QString> CurveScene::textAt(double x_px, double y_px) const {
  std::optional<QString> text;
  double nearest = kPick_px * ratio_;
  for (const ChartLine& line : lines_) {
    for (const ChartPoint& point : line.points) {
      if (!drawable(point)) continue;
      const auto at = labels_->toPixels(point.x, point.y);
      const double distance = std::hypot(at[0] - x_px, at[1] - y_px);
      if (distance > nearest) continue;
      nearest = distance;
      const auto number = [](double value) { return QString::fromStdString(shortNumber(value)); };
      text = QStringLiteral("%1\n%2 mm on %3 places (%4 to %5)")
                 .arg(line.name, number(point.y), number(point.x), number(point.low), number(point.high));
    }
  }
  return text;
}

}  // namespace fieldtrue::widgets
