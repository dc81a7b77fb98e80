#pragma once

#include <QWidget>

#include "widgets/workbench/workbench.h"

class QComboBox;
class QLabel;
class QProgressBar;
class QPushButton;
class QStackedWidget;
class QTabWidget;

namespace fieldtrue::widgets {

class CurvePanel;
class FieldPanel;
class FittedMethods;
class MethodPanel;
class PlacePanel;
class VerdictPanel;
class VolumeStore;

/// Fit and compare: the verdict, the error fields of any two methods, every method's held-out figures, and what is
/// known of each place.
class ComparePage : public QWidget {
  Q_OBJECT
 public:
  explicit ComparePage(Workbench& workbench, QWidget* parent = nullptr);

 protected:
  void showEvent(QShowEvent* event) override;

 private:
  QWidget* makeHeader();
  QWidget* makeControls(QWidget* header);
  QWidget* makeInspector();
  void connectParts();
  void onTable();
  void showPlaceData();
  /// @param quick_first without the slow methods, and with them as soon as that is shown
  void runComparison(bool quick_first);
  void onComparison();
  void onProgress(double fraction);
  /// The verdict, or what keeps the figures from being one.
  void showHeadline();
  void showComparison();
  void showChoice();
  /// Why the chosen methods cannot be fitted now; empty when they can.
  QString whyNotFit() const;
  void onShown();
  void showMarks();
  void fitChosen();
  void selectNode(int node);

  Workbench& workbench_;
  FittedMethods* fitted_methods_;
  VolumeStore* volumes_;
  QStackedWidget* stack_;
  QWidget* header_ = nullptr;
  QLabel* headline_;
  QLabel* verdict_;
  QProgressBar* progress_;
  QLabel* progress_text_;
  QPushButton* run_;
  QComboBox* validation_;
  FieldPanel* fields_;
  QTabWidget* tabs_;
  VerdictPanel* verdict_panel_;
  MethodPanel* position_;
  MethodPanel* rotation_;
  PlacePanel* place_;
  CurvePanel* curve_;
  QPushButton* fit_;
  QLabel* fitted_;
  bool out_of_date_ = true;
  bool slow_to_come_ = false;
  bool stopped_ = false;  ///< By the person, since the last run began.
  int n_compared_ = 0;
  std::optional<std::size_t> shown_best_;  ///< Row of the best in the comparison shown.
};

}  // namespace fieldtrue::widgets
