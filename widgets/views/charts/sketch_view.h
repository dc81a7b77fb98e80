#pragma once

#include <QWidget>

#include "widgets/figures/signal_sketch.h"

namespace fieldtrue::widgets {

/// Draws a sketch, as large as there is room for.
class SketchView : public QWidget {
  Q_OBJECT
 public:
  explicit SketchView(QWidget* parent = nullptr);
  void setSketch(const Sketch& sketch);
  const Sketch& sketch() const { return sketch_; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  Sketch sketch_;
};

}  // namespace fieldtrue::widgets
