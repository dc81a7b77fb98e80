#include "widgets/views/host/overlay.h"

#include <vtkBrush.h>
#include <vtkContext2D.h>
#include <vtkContextActor.h>
#include <vtkContextScene.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPen.h>
#include <vtkRenderer.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "calib/core/number_text.h"
#include "widgets/style/color_scale.h"
#include "widgets/style/units.h"
#include "widgets/views/host/projection.h"
#include "widgets/views/host/scene_font.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kTextSize = 12;
constexpr int kTitleSize = 15;
constexpr double kMargin_px = 12.0;
constexpr double kLine_px = 18.0;
constexpr double kBarWidth_px = 14.0;
constexpr double kBarHeight_px = 190.0;
constexpr double kLeastBarHeight_px = 40.0;
constexpr double kAboveBar_px = 38.0;
constexpr double kBelowBar_px = 34.0;
constexpr double kScaleWidth_px = 92.0;
constexpr int kMostTicks = 7;
constexpr double kLabelGap_px = 10.0;
constexpr double kShortestAxis_px = 90.0;
constexpr double kUpright = 0.9;

enum class Align { kLeft, kCenter, kRight };

/// The painter with the sizes and colours of one overlay; positions in logical pixels from the lower left corner.
class Pencil {
 public:
  Pencil(vtkContext2D* painter, vtkRenderer* renderer, const OverlayContent& content)
      : painter_(painter), content_(content), projection_(renderer) {
    size_px_ = Eigen::Vector2d(renderer->GetSize()[0], renderer->GetSize()[1]) / content.ratio;
  }

  const Theme& theme() const { return *content_.theme; }
  Eigen::Vector2d size_px() const { return size_px_; }

  std::optional<Eigen::Vector2d> place(const Eigen::Vector3d& at_m) const {
    const auto px = projection_.toPixels(at_m);
    return px ? std::optional<Eigen::Vector2d>(px->head<2>() / content_.ratio) : std::nullopt;
  }

  double textWidth_px(const std::string& text, int size, bool bold = false) const {
    setText(theme().text, size, bold, Align::kLeft);
    float bounds[4];
    painter_->ComputeStringBounds(vtkStdString(text), bounds);
    return bounds[2] / content_.ratio;
  }

  /// @param at middle of the text's height; left end, centre or right end by `align`
  void text(const Eigen::Vector2d& at, const std::string& text, const QColor& color, Align align = Align::kLeft,
            int size = kTextSize, bool bold = false) const {
    setText(color, size, bold, align);
    painter_->DrawString(device(at.x()), device(at.y()), vtkStdString(text));
  }

  void fill(const QColor& color, double opacity = 1.0) const {
    painter_->GetPen()->SetLineType(vtkPen::NO_PEN);
    painter_->GetBrush()->SetColorF(color.redF(), color.greenF(), color.blueF(), opacity);
  }

  void frame(const QColor& color, double width_px) const {
    painter_->GetPen()->SetLineType(vtkPen::SOLID_LINE);
    painter_->GetPen()->SetColorF(color.redF(), color.greenF(), color.blueF(), 1.0);
    painter_->GetPen()->SetWidth(device(width_px));
    painter_->GetBrush()->SetColorF(0, 0, 0, 0);
  }

  void rectangle(double x, double y, double width, double height) const {
    painter_->DrawRect(device(x), device(y), device(width), device(height));
  }

  void polygon(const std::vector<Eigen::Vector2d>& corners) const {
    std::vector<float> xy;
    for (const Eigen::Vector2d& corner : corners) {
      xy.push_back(device(corner.x()));
      xy.push_back(device(corner.y()));
    }
    painter_->DrawPolygon(xy.data(), static_cast<int>(corners.size()));
  }

  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
    painter_->DrawLine(device(a.x()), device(a.y()), device(b.x()), device(b.y()));
  }

  void ring(const Eigen::Vector2d& at, double inner_px, double outer_px) const {
    painter_->DrawWedge(device(at.x()), device(at.y()), device(outer_px), device(inner_px), 0.0F, 360.0F);
  }

 private:
  float device(double logical_px) const { return static_cast<float>(logical_px * content_.ratio); }

  void setText(const QColor& color, int size, bool bold, Align align) const {
    vtkTextProperty* property = painter_->GetTextProp();
    setFont(property, bold);
    property->SetFontSize(size);
    property->SetColor(color.redF(), color.greenF(), color.blueF());
    property->SetOpacity(1.0);
    property->SetVerticalJustificationToCentered();
    property->SetJustification(align == Align::kLeft     ? VTK_TEXT_LEFT
                               : align == Align::kCenter ? VTK_TEXT_CENTERED
                                                         : VTK_TEXT_RIGHT);
  }

  vtkContext2D* painter_;
  const OverlayContent& content_;
  Projection projection_;
  Eigen::Vector2d size_px_;
};

void drawScale(const Pencil& pencil, const ScaleLegend& legend, double bottom, double height) {
  const Theme& theme = pencil.theme();
  const double left = pencil.size_px().x() - kMargin_px - kScaleWidth_px;
  pencil.fill(theme.surface, 0.88);
  pencil.rectangle(left - 8.0, bottom - kBelowBar_px, kScaleWidth_px + 8.0, height + kBelowBar_px + kAboveBar_px);
  constexpr int kSteps = 96;
  for (int step = 0; step < kSteps; ++step) {
    pencil.fill(magnitudeColor((step + 0.5) / kSteps));
    pencil.rectangle(left, bottom + height * step / kSteps, kBarWidth_px, height / kSteps + 0.5);
  }
  pencil.frame(theme.line, 1.0);
  pencil.rectangle(left, bottom, kBarWidth_px, height);
  for (const double tick : scaleTicks(legend.maximum)) {
    const double y = bottom + height * tick / legend.maximum;
    pencil.frame(theme.text_muted, 1.0);
    pencil.line({left + kBarWidth_px, y}, {left + kBarWidth_px + 4.0, y});
    const bool top = tick == legend.maximum;
    pencil.text({left + kBarWidth_px + 8.0, y}, shortNumber(tick) + (top && legend.exceeded ? "+" : ""), theme.text);
  }
  pencil.text({left, bottom + height + 22.0}, legend.title, theme.text, Align::kLeft, kTextSize, true);
  pencil.text({left, bottom - 20.0}, legend.note, theme.text);
}

/// The scales one above the other at the right, centred.
void drawScales(const Pencil& pencil, const std::vector<ScaleLegend>& scales) {
  if (scales.empty()) return;
  const double count = static_cast<double>(scales.size());
  const double text = kBelowBar_px + kAboveBar_px;
  const double height = std::min(kBarHeight_px, (pencil.size_px().y() - 2.0 * kMargin_px) / count - text);
  if (height < kLeastBarHeight_px) return;
  double bottom = 0.5 * (pencil.size_px().y() + count * (height + text)) - height - kAboveBar_px;
  for (const ScaleLegend& scale : scales) {
    drawScale(pencil, scale, bottom, height);
    bottom -= height + text;
  }
}

std::vector<Eigen::Vector2d> corners(const Eigen::Vector2d& at, double radius, double first_rad) {
  std::vector<Eigen::Vector2d> points;
  for (int k = 0; k < 4; ++k) {
    const double angle = first_rad + k * 1.5707963267948966;
    points.push_back(at + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return points;
}

void drawSymbol(const Pencil& pencil, const SymbolLegend& legend, const Eigen::Vector2d& at) {
  constexpr double kRadius = 5.0;
  constexpr double kQuarter = 0.7853981633974483;
  pencil.fill(legend.color);
  switch (legend.symbol) {
    case Symbol::kDot:
    case Symbol::kFilledCircle:
      return pencil.ring(at, 0.0, kRadius);
    case Symbol::kCircle:
      return pencil.ring(at, 0.72 * kRadius, kRadius);
    case Symbol::kThickCircle:
      pencil.ring(at, 0.0, 0.35 * kRadius);
      return pencil.ring(at, 0.85 * kRadius, 1.3 * kRadius);
    case Symbol::kFilledSquare:
      return pencil.polygon(corners(at, 1.25 * kRadius, kQuarter));
    case Symbol::kDiamond:
      return pencil.polygon(corners(at, 1.35 * kRadius, 0.0));
    case Symbol::kSquare:
      pencil.frame(legend.color, 1.6);
      return pencil.rectangle(at.x() - 0.8 * kRadius, at.y() - 0.8 * kRadius, 1.6 * kRadius, 1.6 * kRadius);
    case Symbol::kCross:
      pencil.frame(legend.color, 2.0);
      pencil.line(at - Eigen::Vector2d(4, 4), at + Eigen::Vector2d(4, 4));
      pencil.line(at - Eigen::Vector2d(4, -4), at + Eigen::Vector2d(4, -4));
      return;
  }
}

void drawSymbols(const Pencil& pencil, const std::vector<SymbolLegend>& symbols) {
  if (symbols.empty()) return;
  double width = 0.0;
  for (const SymbolLegend& legend : symbols) width = std::max(width, pencil.textWidth_px(legend.text, kTextSize));
  const double height = kLine_px * static_cast<double>(symbols.size());
  pencil.fill(pencil.theme().surface, 0.88);
  pencil.rectangle(kMargin_px, kMargin_px, width + 44.0, height + 12.0);
  double y = kMargin_px + 6.0 + height - 0.5 * kLine_px;
  for (const SymbolLegend& legend : symbols) {
    drawSymbol(pencil, legend, {kMargin_px + 16.0, y});
    pencil.text({kMargin_px + 32.0, y}, legend.text, pencil.theme().text);
    y -= kLine_px;
  }
}

void drawBubble(const Pencil& pencil, const OverlayContent& content) {
  const auto at = pencil.place(content.bubble_at_m);
  if (!at || content.bubble.empty()) return;
  double width = 0.0;
  for (std::size_t k = 0; k < content.bubble.size(); ++k)
    width = std::max(width, pencil.textWidth_px(content.bubble[k], kTextSize, k == 0));
  width += 20.0;
  const double height = kLine_px * static_cast<double>(content.bubble.size()) + 10.0;
  double x = at->x() + 16.0, y = at->y() + 12.0;
  // The colour scale stays in sight.
  const double scales_px = content.scales.empty() ? 4.0 : kScaleWidth_px + kMargin_px + 12.0;
  if (x + width > pencil.size_px().x() - scales_px) x = at->x() - 16.0 - width;
  if (y + height > pencil.size_px().y() - 4.0) y = at->y() - 12.0 - height;
  pencil.fill(pencil.theme().surface);
  pencil.rectangle(x, y, width, height);
  pencil.frame(pencil.theme().text_muted, 1.0);
  pencil.rectangle(x, y, width, height);
  double line_y = y + height - 5.0 - 0.5 * kLine_px;
  for (std::size_t k = 0; k < content.bubble.size(); ++k, line_y -= kLine_px)
    pencil.text({x + 10.0, line_y}, content.bubble[k], pencil.theme().text, Align::kLeft, kTextSize, k == 0);
}

/// Of the four parallel edges of the box along an axis, the one whose labels stand clear: lowest on screen for the
/// horizontal axes, leftmost for the vertical one.
std::optional<std::array<Eigen::Vector3d, 2>> clearEdge(const Pencil& pencil, const SceneSpace& space, int axis) {
  std::optional<std::array<Eigen::Vector3d, 2>> best;
  double best_score = std::numeric_limits<double>::infinity();
  for (int side = 0; side < 4; ++side) {
    Eigen::Vector3d from = space.low_m;
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    if (side & 1) from[a] = space.high_m[a];
    if (side & 2) from[b] = space.high_m[b];
    if (axis != 2 && from.z() != space.low_m.z()) continue;
    Eigen::Vector3d to = from;
    to[axis] = space.high_m[axis];
    const auto middle = pencil.place(0.5 * (from + to));
    if (!middle) continue;
    const double score = axis == 2 ? middle->x() : middle->y();
    if (score < best_score - 0.5) {
      best_score = score;
      best = {from, to};
    }
  }
  return best;
}

/// All with the same decimals: as few as tell the ticks to half a hundredth of the pitch.
std::vector<std::string> tickTexts(const std::vector<double>& ticks_m, double pitch_m, LengthUnit unit) {
  int decimals = 0;
  const auto tells = [&](double tick_m) {
    const double value = tick_m / metresPer(unit), scale = std::pow(10.0, decimals);
    return std::abs(std::round(value * scale) / scale - value) < 0.005 * pitch_m / metresPer(unit);
  };
  while (decimals < 3 && !std::all_of(ticks_m.begin(), ticks_m.end(), tells)) ++decimals;
  std::vector<std::string> texts;
  for (const double tick_m : ticks_m) {
    const double value = tick_m / metresPer(unit);
    texts.push_back(std::abs(value) < 1e-9 ? "0" : QString::number(value, 'f', decimals).toStdString());
  }
  return texts;
}

void drawAxis(const Pencil& pencil, const SceneSpace& space, LengthUnit unit, int axis) {
  const auto edge = clearEdge(pencil, space, axis);
  const auto center = pencil.place(space.center_m());
  if (!edge || !center) return;
  const auto start = pencil.place((*edge)[0]), end = pencil.place((*edge)[1]);
  if (!start || !end || (*end - *start).norm() < kShortestAxis_px) return;
  const Eigen::Vector2d along = (*end - *start).normalized();
  Eigen::Vector2d outward(-along.y(), along.x());
  if (outward.dot(0.5 * (*start + *end) - *center) < 0.0) outward = -outward;
  const Align align = outward.x() > 0.5 ? Align::kLeft : outward.x() < -0.5 ? Align::kRight : Align::kCenter;

  const double pitch = space.pitch_m[axis], origin = space.grid_origin_m[axis];
  const int first = static_cast<int>(std::ceil((space.low_m[axis] - origin) / pitch - 1e-6));
  const int last = static_cast<int>(std::floor((space.high_m[axis] - origin) / pitch + 1e-6));
  const double room = (*end - *start).norm() / 34.0;
  const int every = std::max(1, static_cast<int>(std::ceil((last - first + 1) / std::min<double>(kMostTicks, room))));
  std::vector<double> ticks_m;
  for (int k = first; k <= last; ++k)
    // The corner on the floor belongs to the labels of the horizontal axes.
    if (k % every == 0 && (axis != 2 || origin + k * pitch > space.low_m.z() + 0.3 * pitch))
      ticks_m.push_back(origin + k * pitch);
  const std::vector<std::string> texts = tickTexts(ticks_m, pitch, unit);
  double widest = 0.0;
  for (std::size_t k = 0; k < ticks_m.size(); ++k) {
    Eigen::Vector3d at = (*edge)[0];
    at[axis] = ticks_m[k];
    const auto px = pencil.place(at);
    if (!px) continue;
    const std::string& text = texts[k];
    widest = std::max(widest, pencil.textWidth_px(text, kTextSize));
    pencil.text(*px + kLabelGap_px * outward, text, pencil.theme().text_muted, align);
  }
  const std::string name = std::string(1, "xyz"[axis]) + " (" + unitSymbol(unit).toStdString() + ")";
  const bool upright = std::abs(outward.x()) > kUpright;
  const double clear =
      upright ? kLabelGap_px : 16.0 + std::abs(outward.x()) * widest + std::abs(outward.y()) * kLine_px;
  // Beside an upright axis there is no room for the name: it stands at the upper end.
  const Eigen::Vector2d at = upright ? Eigen::Vector2d(start->y() > end->y() ? *start : *end) : 0.5 * (*start + *end);
  pencil.text(at + clear * outward, name, pencil.theme().text, align, kTextSize, true);
}

}  // namespace

vtkStandardNewMacro(Overlay);

bool Overlay::Paint(vtkContext2D* painter) {
  vtkRenderer* renderer = this->GetScene()->GetRenderer();
  if (renderer == nullptr || renderer->GetSize()[0] < 2 || renderer->GetSize()[1] < 2) return true;
  const Pencil pencil(painter, renderer, content);
  if (content.axes)
    for (int axis = 0; axis < 3; ++axis) drawAxis(pencil, *content.axes, content.unit, axis);
  const Eigen::Vector3d up = worldFromView(renderer).col(1);
  for (const SceneLabel& label : content.labels)
    if (const auto at = pencil.place(label.at_m - label.below_m * up))
      pencil.text(*at, label.text, label.color, Align::kCenter, kTextSize, true);
  drawScales(pencil, content.scales);
  drawSymbols(pencil, content.symbols);
  if (!content.title.empty())
    pencil.text({kMargin_px + 4.0, pencil.size_px().y() - 22.0}, content.title, content.theme->text, Align::kLeft,
                kTitleSize, true);
  drawBubble(pencil, content);
  return true;
}

vtkSmartPointer<Overlay> addOverlay(vtkRenderer* renderer) {
  vtkNew<vtkContextActor> actor;
  vtkNew<Overlay> overlay;
  actor->GetScene()->SetRenderer(renderer);
  actor->GetScene()->AddItem(overlay);
  renderer->AddActor(actor);
  return overlay;
}

std::vector<double> scaleTicks(double maximum) {
  const double step = roundStep(maximum / 5.0);
  std::vector<double> ticks;
  for (int k = 0; k * step < maximum - 0.45 * step; ++k) ticks.push_back(k * step);
  ticks.push_back(maximum);
  return ticks;
}

}  // namespace fieldtrue::widgets
