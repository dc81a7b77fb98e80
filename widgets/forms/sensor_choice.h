#pragma once

#include <QComboBox>

namespace fieldtrue::widgets {

class Workbench;

/// Which sensor's rows are used; to be seen only where the session holds several.
class SensorChoice : public QComboBox {
  Q_OBJECT
 public:
  SensorChoice(Workbench& workbench, const QString& name, QWidget* parent);

 private:
  void refresh();

  Workbench& workbench_;
};

}  // namespace fieldtrue::widgets
