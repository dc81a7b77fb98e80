#pragma once

#include <QMainWindow>

#include "widgets/workbench/workbench.h"

class QStackedWidget;

namespace fieldtrue::widgets {

class DeviceStrip;
class HelpWindow;
class MessageLine;
struct PageRow;
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
  /// A session that is dropped is opened.
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;

 private:
  void openPage(const QString& id);
  void showStates();
  void restoreLayout();
  /// The guide, at what it says of the page on screen.
  void openHelp();

  Workbench* workbench_;
  StepRail* rail_;
  QStackedWidget* pages_;
  MessageLine* messages_;
  DeviceStrip* strip_;
  HelpWindow* help_ = nullptr;     ///< Made when it is first asked for.
  const PageRow* page_ = nullptr;  ///< On screen.
};

}  // namespace fieldtrue::widgets
