#pragma once

#include <QWidget>

#include "acquisition/session/acquisition_controller.h"

class QLabel;

namespace fieldtrue::widgets {

/// The living tracker along the bottom: recording light, state in words, rate, noise now, position now.
class DeviceStrip : public QWidget {
  Q_OBJECT
 public:
  explicit DeviceStrip(QWidget* parent = nullptr);
  void setStatus(const acquisition::AcquisitionStatus& status);

 private:
  QLabel* light_;
  QLabel* state_;
  QLabel* rate_;
  QLabel* noise_;
  QLabel* pose_;
  QLabel* session_;
};

}  // namespace fieldtrue::widgets
