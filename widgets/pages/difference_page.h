#pragma once

#include <QWidget>
#include <optional>

#include "calib/calibration/corrector.h"
#include "calib/evaluation/calibration_difference.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/workbench.h"

class QGridLayout;
class QLabel;
class QLineEdit;
class QProgressBar;
class QPushButton;

namespace fieldtrue::widgets {

class FieldView;

/// What changed between two calibrations of one set-up: an earlier file, and the session's calibration or a later file.
class DifferencePage : public QWidget {
  Q_OBJECT
 public:
  explicit DifferencePage(Workbench& workbench, QWidget* parent = nullptr);

 private:
  QWidget* makeHeader();
  QWidget* makeFacts();
  QLineEdit* addFileRow(QGridLayout* grid, const QString& label, const char* name);
  void choose(QLineEdit* path);
  void runOrStop();
  void run();
  void onResult(Result<evaluation::CalibrationDifference> result);
  void onSessionCalibration();
  void showButtons();
  void showDifference();

  Workbench& workbench_;
  BackgroundJobs jobs_{this};
  std::optional<evaluation::CalibrationDifference> difference_;
  QLabel* headline_ = nullptr;
  QLabel* sentence_ = nullptr;
  QLineEdit* first_ = nullptr;
  QLineEdit* second_ = nullptr;  ///< Empty: the session's calibration.
  QPushButton* run_ = nullptr;
  QProgressBar* progress_ = nullptr;
  FieldView* field_ = nullptr;
  QGridLayout* facts_ = nullptr;
};

}  // namespace fieldtrue::widgets
