#pragma once

#include <QWidget>

#include "widgets/pages/workbench.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QProgressBar;
class QPushButton;
class QSlider;
class QStackedWidget;

namespace fieldtrue {

class FieldView;
class HistogramView;
class MethodPanel;

/// Fit and compare: the verdict, the error field before and after on one colour scale, and every method's held-out
/// figures.
class ComparePage : public QWidget {
  Q_OBJECT
 public:
  explicit ComparePage(Workbench& workbench, QWidget* parent = nullptr);

 protected:
  void showEvent(QShowEvent* event) override;

 private:
  QWidget* makeHeader();
  QWidget* makeViews();
  QWidget* makeViewBar();
  QWidget* makeInspector();
  void onTable();
  void runComparison();
  void onComparison();
  void onCorrector();
  void drawFields();
  void chooseScale(const Comparison& comparison);
  void magnify(double magnification);
  void fitChosen();
  void selectNode(int node);
  QString describeNode(int node) const;

  Workbench& workbench_;
  QStackedWidget* stack_;
  QLabel* verdict_;
  QLabel* details_;
  QProgressBar* progress_;
  QPushButton* run_;
  QComboBox* validation_;
  FieldView* before_;
  FieldView* after_;
  HistogramView* histogram_;
  QSlider* scale_;
  QLabel* scale_text_;
  QCheckBox* two_views_;
  QCheckBox* orientation_;
  QLabel* hovered_;
  MethodPanel* position_;
  MethodPanel* rotation_;
  QPushButton* fit_;
  QLabel* fitted_;
  bool scale_chosen_by_hand_ = false;
  bool out_of_date_ = true;
};

}  // namespace fieldtrue
