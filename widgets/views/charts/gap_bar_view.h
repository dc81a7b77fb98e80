#pragma once

#include <QWidget>

#include "widgets/figures/gap_bars.h"

namespace fieldtrue::widgets {

/// Horizontal bars with their names, values, whiskers and notes.
class GapBarView : public QWidget {
  Q_OBJECT
 public:
  explicit GapBarView(QWidget* parent = nullptr);
  void setChart(const GapBarChart& chart);
  const GapBarChart& chart() const { return chart_; }
  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;
  bool hasHeightForWidth() const override { return true; }
  int heightForWidth(int width) const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  int noteHeight(const GapBar& bar, int width) const;
  int rowHeight(const GapBar& bar, int width) const;
  int titleHeight(int width) const;
  void drawBar(QPainter& painter, const GapBar& bar, int top) const;

  GapBarChart chart_;
};

}  // namespace fieldtrue::widgets
