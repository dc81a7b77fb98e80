#pragma once

#include <QMainWindow>
#include <map>

#include "widgets/pages/workbench.h"

class QStackedWidget;

namespace fieldtrue {

class DeviceStrip;
class GapPage;
class MessageLine;
class StepRail;

/// The window: steps at the left, one page a step, the message line and the living tracker below. It only wires.
class MainWindow : public QMainWindow {
  Q_OBJECT
 public:
  explicit MainWindow(QWidget* parent = nullptr);
  ~MainWindow() override;
  Workbench& workbench() { return *workbench_; }

 protected:
  void closeEvent(QCloseEvent* event) override;

 private:
  void addPage(Step step, QWidget* page);
  void openStep(Step step);
  void showStates();
  void restoreLayout();

  Workbench* workbench_;
  StepRail* rail_;
  QStackedWidget* pages_;
  MessageLine* messages_;
  DeviceStrip* strip_;
  GapPage* gap_;
  std::map<Step, QWidget*> page_of_;
};

}  // namespace fieldtrue
