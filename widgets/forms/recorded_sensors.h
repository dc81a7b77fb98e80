#pragma once

#include <QWidget>
#include <map>
#include <vector>

#include "acquisition/session/acquisition_controller.h"

class QCheckBox;
class QComboBox;
class QGridLayout;
class QLabel;

namespace fieldtrue::widgets {

class Workbench;

/// Which of a tracker's sensors are recorded, a box each, and which of them leads; to be seen only where there are
/// several.
class RecordedSensors : public QWidget {
  Q_OBJECT
 public:
  RecordedSensors(Workbench& workbench, QWidget* parent);

 private:
  void onStatus(const acquisition::AcquisitionStatus& status);
  void makeBoxes(const std::vector<int>& sensors);
  void showLeader(const acquisition::AcquisitionStatus& status);
  void choose(int sensor, bool recorded);
  void lead(int sensor);
  /// @param sensors the leading one first
  void record(const std::vector<int>& sensors);

  Workbench& workbench_;
  QGridLayout* grid_;
  QComboBox* leader_;
  QLabel* hint_;
  std::map<int, QCheckBox*> boxes_;  ///< By sensor.
};

}  // namespace fieldtrue::widgets
