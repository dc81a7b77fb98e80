#pragma once

#include <QWidget>

#include "widgets/workbench/workbench.h"

class QVBoxLayout;

namespace fieldtrue::widgets {

/// The first minute: run the demonstration, connect a tracker, open a session; recent sessions below.
class StartPage : public QWidget {
  Q_OBJECT
 public:
  explicit StartPage(Workbench& workbench, QWidget* parent = nullptr);
  void refreshRecent();

 private:
  void openWithDialog();
  Workbench& workbench_;
  QVBoxLayout* recent_;
};

}  // namespace fieldtrue::widgets
