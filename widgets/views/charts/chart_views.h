#pragma once

#include <QString>
#include <memory>
#include <vector>

#include "widgets/views/charts/curve_scene.h"
#include "widgets/views/host/vtk_host.h"

namespace fieldtrue::widgets {

class HistogramScene;

/// How many places have which error, one set of bars per series in the same bins.
class HistogramView : public VtkHost {
  Q_OBJECT
 public:
  explicit HistogramView(QWidget* parent = nullptr);
  ~HistogramView() override;

  /// @param names of the series, "Before" first
  /// @param values_mm one list per name [mm]; values that are not finite are left out
  void setSeries(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                 const QString& axis_title, const std::vector<std::size_t>& colors = {});

 protected:
  void restyle(double pixel_ratio) override;
  void prepareFrame() override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void leaveEvent(QEvent* event) override;

 private:
  std::unique_ptr<HistogramScene> scene_;
};

/// Held-out error against the number of places fitted to: one line a method, named at its end.
class CurveView : public VtkHost {
  Q_OBJECT
 public:
  explicit CurveView(QWidget* parent = nullptr);
  ~CurveView() override;

  void setLines(const std::vector<ChartLine>& lines, const QString& x_title, const QString& y_title);
  const std::vector<ChartLine>& lines() const;

 protected:
  void restyle(double pixel_ratio) override;
  void prepareFrame() override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void leaveEvent(QEvent* event) override;

 private:
  std::unique_ptr<CurveScene> scene_;
};

}  // namespace fieldtrue::widgets
