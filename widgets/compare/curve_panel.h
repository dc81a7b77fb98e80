#pragma once

#include <QWidget>

#include "calib/evaluation/learning_curve.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/compared_methods.h"

class QComboBox;
class QLabel;
class QProgressBar;
class QPushButton;

namespace fieldtrue::widgets {

class CurveView;

/// Held-out error against the number of places used, computed when asked for.
class CurvePanel : public QWidget {
  Q_OBJECT
 public:
  explicit CurvePanel(QWidget* parent = nullptr);

  /// Forgets the curves, which belong to other data.
  void setComparison(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison);
  /// The methods of the views.
  void showMethods(MethodRow left, MethodRow right);
  const std::vector<evaluation::LearningCurve>& curves() const { return curves_; }
  bool isRunning() const { return jobs_.busy(); }
  void stop();

 private:
  enum class Which { kBest, kShown, kAll };
  void run();
  std::vector<std::size_t> chosenRows() const;
  void arrived(const std::vector<std::size_t>& rows, Result<std::vector<evaluation::LearningCurve>> result);
  void draw();
  void showState();
  QString verdictText() const;

  CalibrationTable table_;
  std::optional<evaluation::Comparison> comparison_;
  MethodRow left_row_, right_row_;
  std::vector<std::size_t> rows_;  ///< Of the comparison, one per curve.
  std::vector<evaluation::LearningCurve> curves_;
  BackgroundJobs jobs_{this};
  QComboBox* which_;
  QPushButton* start_;
  QProgressBar* progress_;
  CurveView* view_;
  QLabel* text_;
};

}  // namespace fieldtrue::widgets
