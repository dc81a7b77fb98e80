#include "widgets/report/report_curves.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/core/number_text.h"
#include "calib/correctors/method_label.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_data.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kMostCurves = 8;
constexpr double kWidth = 900.0;
constexpr double kHeight = 440.0;
constexpr double kLeft = 64.0;
constexpr double kRight = 250.0;
constexpr double kTop = 12.0;
constexpr double kBottom = 48.0;
constexpr double kLineHeight = 17.0;
/// Told apart by those who see few colours too, on a light and on a dark page (after Okabe and Ito).
constexpr std::array<const char*, kMostCurves> kColors = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                          "#e69f00", "#56b4e9", "#8a6d3b", "#7f7f7f"};

std::string px(double value) { return fixedText(value, 1); }

/// Places to the right, error upwards by its logarithm.
class Axes {
 public:
  explicit Axes(const std::vector<const evaluation::LearningCurve*>& curves) {
    for (const evaluation::LearningCurve* curve : curves)
      for (const evaluation::LearningPoint& point : curve->points) {
        most_places_ = std::max(most_places_, static_cast<double>(point.n_places));
        low_mm_ = std::min(low_mm_, std::max(point.rms, 1e-3));
        high_mm_ = std::max(high_mm_, point.rms);
      }
    low_mm_ *= 0.9;
    high_mm_ = std::max(1.1 * high_mm_, 1.5 * low_mm_);
  }
  double x(double n_places) const { return kLeft + (kWidth - kLeft - kRight) * n_places / most_places_; }
  double y(double rms_mm) const {
    const double share = std::log(std::max(rms_mm, low_mm_) / low_mm_) / std::log(high_mm_ / low_mm_);
    return kHeight - kBottom - (kHeight - kTop - kBottom) * share;
  }
  double mostPlaces() const { return most_places_; }
  /// 1, 2 and 5 times powers of ten within the range.
  std::vector<double> ticks_mm() const {
    std::vector<double> ticks;
    for (double decade = std::pow(10.0, std::floor(std::log10(low_mm_))); decade <= high_mm_; decade *= 10.0)
      for (const double digit : {1.0, 2.0, 5.0})
        if (digit * decade >= low_mm_ && digit * decade <= high_mm_) ticks.push_back(digit * decade);
    return ticks;
  }

 private:
  double most_places_ = 1.0;
  double low_mm_ = HUGE_VAL;
  double high_mm_ = 0.0;
};

void text(HtmlWriter& html, double x, double y, const char* anchor, const std::string& content,
          const std::string& color = "currentColor") {
  html.element("text", content,
               {{"x", px(x)}, {"y", px(y)}, {"text-anchor", anchor}, {"font-size", "13"}, {"fill", color}});
}

void line(HtmlWriter& html, double x1, double y1, double x2, double y2, const char* opacity) {
  html.element("line", "",
               {{"x1", px(x1)},
                {"y1", px(y1)},
                {"x2", px(x2)},
                {"y2", px(y2)},
                {"stroke", "currentColor"},
                {"stroke-opacity", opacity}});
}

void drawAxes(HtmlWriter& html, const Axes& axes, const evaluation::LearningCurve& longest) {
  const double right = kWidth - kRight;
  const double bottom = kHeight - kBottom;
  line(html, kLeft, bottom, right, bottom, "0.7");
  for (const double tick_mm : axes.ticks_mm()) {
    line(html, kLeft, axes.y(tick_mm), right, axes.y(tick_mm), "0.15");
    text(html, kLeft - 6.0, axes.y(tick_mm) + 4.0, "end", significantText(tick_mm, 1));
  }
  for (const evaluation::LearningPoint& point : longest.points)
    text(html, axes.x(point.n_places), bottom + 18.0, "middle", std::to_string(point.n_places));
  text(html, 0.5 * (kLeft + right), kHeight - 8.0, "middle", "places fitted to");
  html.element("text", "held-out RMS (mm)",
               {{"x", "0"},
                {"y", "0"},
                {"transform", "translate(16 " + px(0.5 * bottom) + ") rotate(-90)"},
                {"text-anchor", "middle"},
                {"font-size", "13"},
                {"fill", "currentColor"}});
}

void drawCurve(HtmlWriter& html, const Axes& axes, const evaluation::LearningCurve& curve, const char* color) {
  std::string upper;
  std::string lower;
  std::string middle;
  for (const evaluation::LearningPoint& point : curve.points) {
    const std::string x = px(axes.x(point.n_places));
    const auto at = [&](double rms) { return std::string(x).append(",").append(px(axes.y(rms))).append(" "); };
    upper += at(point.high);
    lower.insert(0, at(point.low));
    middle += at(point.rms);
  }
  html.element("polygon", "", {{"points", upper + lower}, {"fill", color}, {"fill-opacity", "0.12"}});
  html.element("polyline", "", {{"points", middle}, {"fill", "none"}, {"stroke", color}, {"stroke-width", "2"}});
}

/// Names at the ends of their curves, moved apart where they would touch.
void drawNames(HtmlWriter& html, const Axes& axes, const std::vector<const evaluation::LearningCurve*>& curves) {
  double lowest = kTop;
  for (std::size_t i = curves.size(); i-- > 0;) {
    const evaluation::LearningPoint& end = curves[i]->points.back();
    const double y = std::max(axes.y(end.rms) + 4.0, lowest);
    lowest = y + kLineHeight;
    text(html, kWidth - kRight + 10.0, y, "start",
         correctors::positionLabel(curves[i]->method, curves[i]->settings) + " " + errorFigure(end.rms), kColors[i]);
  }
}

}  // namespace

void writeLearningCurves(HtmlWriter& html, const std::vector<evaluation::LearningCurve>& curves) {
  std::vector<const evaluation::LearningCurve*> drawn;
  for (const evaluation::LearningCurve& curve : curves)
    if (!curve.points.empty()) drawn.push_back(&curve);
  if (drawn.empty()) return;
  const auto least_first = [](const evaluation::LearningCurve* a, const evaluation::LearningCurve* b) {
    return a->points.back().rms < b->points.back().rms;
  };
  std::stable_sort(drawn.begin(), drawn.end(), least_first);
  const std::size_t n_left_out = drawn.size() - std::min(drawn.size(), kMostCurves);
  drawn.resize(drawn.size() - n_left_out);
  const Axes axes(drawn);
  html.element("h2", "Learning curve");
  html.open("figure", {{"id", "learning-curve"}});
  html.open("svg", {{"viewBox", "0 0 " + px(kWidth) + " " + px(kHeight)},
                    {"width", "100%"},
                    {"role", "img"},
                    {"aria-label", "Held-out error against the number of places fitted to"}});
  const auto most_points = [](const evaluation::LearningCurve* a, const evaluation::LearningCurve* b) {
    return a->points.size() < b->points.size();
  };
  drawAxes(html, axes, **std::max_element(drawn.begin(), drawn.end(), most_points));
  for (std::size_t i = 0; i < drawn.size(); ++i) drawCurve(html, axes, *drawn[i], kColors[i]);
  drawNames(html, axes, drawn);
  html.close();
  html.element("figcaption",
               "Error on places held out for all, by the number of places fitted to: median and range over random "
               "draws" +
                   (n_left_out > 0 ? "; the " + std::to_string(drawn.size()) + " best methods of " +
                                         std::to_string(drawn.size() + n_left_out)
                                   : std::string()));
  html.close();
}

}  // namespace fieldtrue::widgets
