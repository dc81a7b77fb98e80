#pragma once

#include <QWidget>
#include <optional>

#include "calib/calibration/corrector.h"
#include "calib/evaluation/calibration_difference.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/workbench.h"

class QComboBox;
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
  struct Compared {
    std::vector<int> sensors;  ///< To choose from; empty where one correction is for all.
    int sensor = 0;            ///< Of these.
    evaluation::CalibrationDifference difference;
  };
  /// @param wanted the sensor, where a calibration holds a correction for each; the first of both if it is none of them
  static Result<Compared> compare(const calibration::Corrector& first, const calibration::Corrector& second, int wanted,
                                  const RunControl& control);
  void onResult(Result<Compared> result);
  void showSensors(const std::vector<int>& sensors, int sensor);
  void forget();
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
  QLabel* sensor_label_ = nullptr;
  QComboBox* sensor_ = nullptr;  ///< To be seen only where a calibration holds a correction for each.
  QPushButton* run_ = nullptr;
  QProgressBar* progress_ = nullptr;
  FieldView* field_ = nullptr;
  QGridLayout* facts_ = nullptr;
};

}  // namespace fieldtrue::widgets
