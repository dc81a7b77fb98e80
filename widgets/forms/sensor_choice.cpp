#include "widgets/forms/sensor_choice.h"

#include "widgets/workbench/workbench.h"

namespace fieldtrue::widgets {

SensorChoice::SensorChoice(Workbench& workbench, const QString& name, QWidget* parent)
    : QComboBox(parent), workbench_(workbench) {
  setObjectName(name);
  setAccessibleName(tr("Sensor"));
  connect(&workbench_, &Workbench::tableChanged, this, &SensorChoice::refresh);
  connect(&workbench_, &Workbench::sessionChanged, this, &SensorChoice::refresh);
  connect(this, &QComboBox::activated, this, [this](int index) {
    const QVariant sensor = itemData(index);
    workbench_.chooseSensor(sensor.isValid() ? std::optional(sensor.toInt()) : std::nullopt);
  });
  refresh();
}

void SensorChoice::refresh() {
  clear();
  addItem(tr("All sensors"));
  for (const int sensor : workbench_.sensors()) addItem(tr("Sensor %1").arg(sensor), sensor);
  const std::optional<int> chosen = workbench_.chosenSensor();
  setCurrentIndex(chosen ? findData(*chosen) : 0);
  setVisible(count() > 2);
}

}  // namespace fieldtrue::widgets
