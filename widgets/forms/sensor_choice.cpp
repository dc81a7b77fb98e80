#include "widgets/forms/sensor_choice.h"

#include "widgets/workbench/workbench.h"

namespace fieldtrue::widgets {

SensorChoice::SensorChoice(Workbench& workbench, const QString& name, QWidget* parent)
    : QComboBox(parent), workbench_(workbench) {
  setObjectName(name);
  setAccessibleName(tr("Sensor"));
  setPlaceholderText(tr("Choose a sensor"));
  connect(&workbench_, &Workbench::tableChanged, this, &SensorChoice::refresh);
  connect(&workbench_, &Workbench::sessionChanged, this, &SensorChoice::refresh);
  connect(this, &QComboBox::activated, this, [this](int index) { workbench_.chooseSensor(itemData(index).toInt()); });
  refresh();
}

void SensorChoice::refresh() {
  clear();
  for (const int sensor : workbench_.sensors()) addItem(tr("Sensor %1").arg(sensor), sensor);
  const std::optional<int> chosen = workbench_.chosenSensor();
  setCurrentIndex(chosen ? findData(*chosen) : -1);
  setVisible(count() > 1);
}

}  // namespace fieldtrue::widgets
