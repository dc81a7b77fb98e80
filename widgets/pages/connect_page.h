#pragma once

#include <QWidget>
#include <vector>

#include "widgets/workbench/workbench.h"

class QComboBox;
class QLabel;
class QLineEdit;
class QPushButton;

namespace fieldtrue::widgets {

class SettingsForm;

/// Chooses and connects a tracker: kind, line, settings; shows what it says of itself and whether it is alive.
class ConnectPage : public QWidget {
  Q_OBJECT
 public:
  explicit ConnectPage(Workbench& workbench, QWidget* parent = nullptr);

 private:
  void onKind();
  void refreshLines();
  void onStatus(const acquisition::AcquisitionStatus& status);
  QString deviceText() const;
  void chooseScene();
  QString scenePath() const;
  QWidget* makeSetup();
  void tellSetup();

  Workbench& workbench_;
  QComboBox* kind_;
  QLabel* kind_help_;
  QLabel* address_label_;
  QComboBox* address_;
  QPushButton* refresh_;
  QLabel* scene_label_;
  QComboBox* scene_;
  SettingsForm* settings_;
  QLabel* setup_label_;
  QWidget* setup_;
  std::vector<QLineEdit*> setup_facts_;  ///< In the order of the facts that are asked for.
  QPushButton* connect_;
  QPushButton* next_;
  QLabel* state_;
  QLabel* numbers_;
};

}  // namespace fieldtrue::widgets
