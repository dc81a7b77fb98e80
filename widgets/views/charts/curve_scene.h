#pragma once

#include <vtkSmartPointer.h>

#include <QString>
#include <optional>
#include <vector>

#include "widgets/style/theme.h"

class vtkChartXY;
class vtkContextActor;
class vtkRenderer;

namespace fieldtrue::widgets {

class CurveLabels;

/// A point of a line with the range it was found in.
struct ChartPoint {
  double x = 0.0;
  double y = 0.0;  ///< Above 0: the vertical axis is logarithmic.
  double low = 0.0;
  double high = 0.0;
};

/// One line of a chart, named at its right end.
struct ChartLine {
  QString name;
  std::size_t color = 1;  ///< As seriesColor numbers them.
  std::vector<ChartPoint> points;
};

/// Round values 1, 2, 5 times powers of ten that a logarithmic axis from low to high shows, at least two.
std::vector<double> logTicks(double low, double high);

/// Heights at which labels stand: as near as may be to those wanted, each at least `gap` from the next, inside bounds.
std::vector<double> spreadLabels(std::vector<double> wanted, double gap, double low, double high);

/// What CurveView and renderCurvePicture draw.
class CurveScene {
 public:
  explicit CurveScene(vtkRenderer* renderer);
  ~CurveScene();

  void setLines(const std::vector<ChartLine>& lines, const QString& x_title, const QString& y_title);
  void setStyle(const Theme& theme, double ratio);
  void update();
  const std::vector<ChartLine>& lines() const { return lines_; }

  /// The point near a position [device pixels from the lower left corner], in words.
  std::optional<QString> textAt(double x_px, double y_px) const;

 private:
  void rebuild();
  void fillSize();
  void styleAxis(int axis, const QString& title, const std::vector<double>& ticks, bool logarithmic);

  vtkRenderer* renderer_;
  vtkSmartPointer<vtkContextActor> actor_;
  vtkSmartPointer<vtkChartXY> chart_;
  vtkSmartPointer<CurveLabels> labels_;
  std::vector<ChartLine> lines_;
  QString x_title_, y_title_;
  const Theme* theme_ = &Theme::of(false);
  double ratio_ = 1.0;
  bool changed_ = true;
};

}  // namespace fieldtrue::widgets
