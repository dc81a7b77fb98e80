#include "tests/bench/growth_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace fieldtrue::bench {
namespace {

constexpr double kWidth = 620.0;
constexpr double kHeight = 460.0;
constexpr double kLeft = 70.0;
constexpr double kRight = 150.0;  // Room for the methods' names.
constexpr double kTop = 40.0;
constexpr double kBottom = 50.0;
constexpr double kNameHeight = 12.0;

std::string number(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Ten colours and three kinds of line: thirty methods can be told apart.
std::string lineStyle(std::size_t i) {
  static constexpr std::array<const char*, 10> kColours = {"#1f6fb4", "#d1471f", "#2f8f3a", "#8a4fb0", "#8c5a3c",
                                                           "#d2478f", "#5f6a72", "#a39a14", "#149aa8", "#222222"};
  static constexpr std::array<const char*, 3> kDashes = {"none", "7 3", "2 2"};
  return std::string("stroke=\"") + kColours[i % kColours.size()] + "\" stroke-dasharray=\"" +
         kDashes[i % kDashes.size()] + "\"";
}

std::string timeName(double seconds) {
  if (seconds < 1e-6) return number("%.0f ns", 1e9 * seconds);
  if (seconds < 1e-3) return number("%.0f us", 1e6 * seconds);
  return seconds < 1.0 ? number("%.0f ms", 1e3 * seconds) : number("%.0f s", seconds);
}

/// One plot: a value [s] over the number of places.
class Plot {
 public:
  Plot(const std::vector<GrowthCurve>& curves, std::string title, double (*value)(const GrowthCurve::Point&))
      : curves_(curves), title_(std::move(title)), value_(value) {
    for (const GrowthCurve& curve : curves)
      for (const GrowthCurve::Point& point : curve.points) {
        low_n_ = std::min(low_n_, std::log10(double(point.n)));
        high_n_ = std::max(high_n_, std::log10(double(point.n)));
        low_ = std::min(low_, std::floor(std::log10(value(point))));
        high_ = std::max(high_, std::ceil(std::log10(value(point))));
      }
  }

  std::string svg() const {
    std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number("%.0f", kWidth) + "\" height=\"" +
                       number("%.0f", kHeight) + "\" font-family=\"sans-serif\" font-size=\"11\">\n";
    text += label(kLeft, 20.0, title_, "start", "font-size=\"14\" font-weight=\"bold\"");
    if (high_ < low_) return text + "</svg>\n";
    text += axes();
    for (std::size_t i = 0; i < curves_.size(); ++i) text += line(i);
    return text + names() + "</svg>\n";
  }

 private:
  double x(int n) const {
    return kLeft + (std::log10(double(n)) - low_n_) / std::max(1e-9, high_n_ - low_n_) * (kWidth - kLeft - kRight);
  }
  double y(double value) const {
    return kTop + (high_ - std::log10(value)) / std::max(1e-9, high_ - low_) * (kHeight - kTop - kBottom);
  }
  static std::string label(double x, double y, const std::string& text, const char* anchor, const std::string& more) {
    return "<text x=\"" + number("%.1f", x) + "\" y=\"" + number("%.1f", y) + "\" text-anchor=\"" + anchor + "\" " +
           more + ">" + text + "</text>\n";
  }
  static std::string rule(double x1, double y1, double x2, double y2, const std::string& style) {
    return "<line x1=\"" + number("%.1f", x1) + "\" y1=\"" + number("%.1f", y1) + "\" x2=\"" + number("%.1f", x2) +
           "\" y2=\"" + number("%.1f", y2) + "\" " + style + "/>\n";
  }

  std::string axes() const {
    std::string text;
    for (double power = low_; power <= high_ + 0.5; power += 1.0) {
      const double at = y(std::pow(10.0, power));
      text += rule(kLeft, at, kWidth - kRight, at, "stroke=\"#ddd\"");
      text += label(kLeft - 6.0, at + 4.0, timeName(std::pow(10.0, power)), "end", "");
    }
    for (const int n : {100, 200, 500, 1000, 2000, 5000}) {
      if (std::log10(double(n)) < low_n_ - 0.01 || std::log10(double(n)) > high_n_ + 0.01) continue;
      text += rule(x(n), kTop, x(n), kHeight - kBottom, "stroke=\"#eee\"");
      text += label(x(n), kHeight - kBottom + 16.0, std::to_string(n), "middle", "");
    }
    return text + label((kLeft + kWidth - kRight) / 2.0, kHeight - 12.0, "places", "middle", "");
  }

  std::string line(std::size_t i) const {
    std::string path;
    for (const GrowthCurve::Point& point : curves_[i].points)
      path += number("%.1f", x(point.n)) + "," + number("%.1f ", y(value_(point)));
    return path.empty()
               ? ""
               : "<polyline fill=\"none\" stroke-width=\"1.8\" " + lineStyle(i) + " points=\"" + path + "\"/>\n";
  }

  /// Names beside the ends of their lines, pushed apart where they would overlap.
  std::string names() const {
    struct Name {
      std::size_t curve;
      double end_x, end_y, y;
    };
    std::vector<Name> names;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      if (curves_[i].points.empty()) continue;
      const GrowthCurve::Point& last = curves_[i].points.back();
      names.push_back({i, x(last.n), y(value_(last)), y(value_(last))});
    }
    std::sort(names.begin(), names.end(), [](const Name& a, const Name& b) { return a.y < b.y; });
    for (std::size_t i = 1; i < names.size(); ++i) names[i].y = std::max(names[i].y, names[i - 1].y + kNameHeight);
    double lowest = kHeight - 4.0;
    for (std::size_t i = names.size(); i-- > 0; lowest = names[i].y - kNameHeight)
      names[i].y = std::min(names[i].y, lowest);
    std::string text;
    for (const Name& name : names) {
      const double at_x = kWidth - kRight + 12.0;
      text += rule(name.end_x, name.end_y, at_x - 2.0, name.y, lineStyle(name.curve) + " stroke-width=\"0.6\"");
      text += label(at_x, name.y + 4.0, curves_[name.curve].method, "start", "");
    }
    return text;
  }

  const std::vector<GrowthCurve>& curves_;
  std::string title_;
  double (*value_)(const GrowthCurve::Point&);
  double low_n_ = 1e9, high_n_ = -1e9, low_ = 1e9, high_ = -1e9;
};

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return safe;
}

std::string table(const std::vector<GrowthCurve>& curves) {
  std::vector<int> sizes;
  for (const GrowthCurve& curve : curves)
    for (const GrowthCurve::Point& point : curve.points) sizes.push_back(point.n);
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  std::string text = "<table><tr><th>method</th>";
  for (const int n : sizes) text += "<th>n = " + std::to_string(n) + "</th>";
  text += "<th>not measured</th></tr>\n";
  for (const GrowthCurve& curve : curves) {
    text += "<tr><td>" + curve.method + "</td>";
    for (const int n : sizes) {
      const auto found =
          std::find_if(curve.points.begin(), curve.points.end(), [n](const auto& p) { return p.n == n; });
      text += found == curve.points.end() ? "<td></td>"
                                          : "<td>" + number("%.3g s", found->fit_s) + "<br>" +
                                                number("%.3g us", 1e-3 * found->evaluation_ns) + "</td>";
    }
    text += "<td>" + escaped(curve.remark) + "</td></tr>\n";
  }
  return text + "</table>\n";
}

}  // namespace

std::string growthPage(const std::vector<GrowthCurve>& curves, const std::string& conditions) {
  const Plot fit(curves, "Time of one fit", [](const GrowthCurve::Point& point) { return point.fit_s; });
  const Plot evaluation(curves, "Time of one evaluation, in batches",
                        [](const GrowthCurve::Point& point) { return 1e-9 * point.evaluation_ns; });
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Growth of cost</title>\n"
         "<style>body{font-family:sans-serif}td,th{padding:2px 8px;text-align:right;border-bottom:1px solid #ddd;"
         "font-size:12px;vertical-align:top}td:first-child,td:last-child{text-align:left}</style></head>\n"
         "<body><h1>Growth of cost with the number of places</h1>\n<p>" +
         escaped(conditions) + "</p>\n" + fit.svg() + evaluation.svg() +
         "<p>Of each method: time of one fit, and below it of one evaluation.</p>\n" + table(curves) +
         "</body></html>\n";
}

}  // namespace fieldtrue::bench
