#pragma once

#include <QWidget>
#include <map>

#include "acquisition/session/acquisition_controller.h"

class QCheckBox;
class QGridLayout;
class QLabel;

namespace fieldtrue::widgets {

class Workbench;

/// Which of a tracker's sensors are recorded, a box each; to be seen only where there are several.
class RecordedSensors : public QWidget {
  Q_OBJECT
 public:
  RecordedSensors(Workbench& workbench, QWidget* parent);

 private:
  void onStatus(const acquisition::AcquisitionStatus& status);
  void makeBoxes(const std::vector<int>& sensors);
  void choose(int sensor, bool recorded);

  Workbench& workbench_;
  QGridLayout* grid_;
  QLabel* hint_;
  std::map<int, QCheckBox*> boxes_;  ///< By sensor.
};

}  // namespace fieldtrue::widgets
