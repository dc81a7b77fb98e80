#pragma once

#include <vtkSmartPointer.h>

#include <QString>
#include <optional>
#include <vector>

#include "widgets/style/theme.h"

class vtkChartXY;
class vtkContextActor;
class vtkRenderer;
class vtkTextProperty;

namespace fieldtrue::widgets {

/// Counts in bins of one width from 0, the same for every series.
struct Histogram {
  double width_mm = 1.0;
  std::vector<std::vector<int>> counts;  ///< One list per series, all of one length.
};

/// Bins of a round width, at most 30, from 0 to the largest value; values that are not finite are left out.
Histogram histogramOf(const std::vector<std::vector<double>>& values_mm);

/// The colour of the n-th series of every chart: 0 is before correction, then the methods, all different.
QColor seriesColor(std::size_t series, const Theme& theme);

/// The font, size and colour of words in charts.
void setChartText(vtkTextProperty* text, const QColor& color, bool bold = false);

/// What HistogramView and renderPicture draw.
class HistogramScene {
 public:
  explicit HistogramScene(vtkRenderer* renderer);
  ~HistogramScene();

  /// @param colors index of each series' colour; by default those of before, after and so on
  void setSeries(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                 const QString& axis_title, const std::vector<std::size_t>& colors = {});
  void setStyle(const Theme& theme, double ratio);
  void update();

  /// What stands in the bin at a horizontal position [device pixels from the left], in words.
  std::optional<QString> textAt(double x_px) const;

 private:
  void rebuild();
  void styleAxis(int axis, const QString& title);
  void setTicks(int axis, double maximum, double step);

  vtkRenderer* renderer_;
  vtkSmartPointer<vtkContextActor> actor_;
  vtkSmartPointer<vtkChartXY> chart_;
  std::vector<QString> names_;
  std::vector<std::size_t> colors_;
  QString axis_title_;
  Histogram histogram_;
  const Theme* theme_ = &Theme::of(false);
  double ratio_ = 1.0;
  bool changed_ = true;
};

}  // namespace fieldtrue::widgets
