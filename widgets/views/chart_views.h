#pragma once

#include <QString>
#include <memory>
#include <vector>

#include "widgets/views/vtk_host.h"

namespace fieldtrue {

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
                 const QString& axis_title);

 protected:
  void restyle(double pixel_ratio) override;
  void prepareFrame() override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void leaveEvent(QEvent* event) override;

 private:
  std::unique_ptr<HistogramScene> scene_;
};

}  // namespace fieldtrue
