#pragma once

#include <QThread>
#include <QWidget>
#include <vector>

#include "acquisition/search/tracker_search.h"
#include "widgets/workbench/workbench.h"

class QComboBox;
class QLabel;
class QLineEdit;
class QListWidget;
class QListWidgetItem;
class QPushButton;

namespace fieldtrue::widgets {

class SettingsForm;

/// Chooses and connects a tracker: kind, line, settings; shows what it says of itself and whether it is alive.
class ConnectPage : public QWidget {
  Q_OBJECT
 public:
  explicit ConnectPage(Workbench& workbench, QWidget* parent = nullptr);
  ~ConnectPage() override;

 private:
  void makeFinder();
  void find();
  void stopFinding();
  void onLineDone(const acquisition::LineFinding& finding);
  void onFound();
  void use(const QListWidgetItem* item);
  void onKind();
  void refreshLines();
  void onStatus(const acquisition::AcquisitionStatus& status);
  QString deviceText() const;
  void chooseScene();
  QString scenePath() const;
  QWidget* makeSetup();
  bool isSimulated() const;   ///< The tracker that is chosen.
  Setup statedSetup() const;  ///< Of that tracker: of a simulated one nothing.

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
  QPushButton* find_;
  QListWidget* found_;
  QThread search_thread_;
  acquisition::TrackerSearch* search_ = nullptr;  ///< Runs in its thread; null while nothing is searched.
  QPushButton* connect_;
  QPushButton* next_;
  QPushButton* save_;
  QLabel* state_;
  QLabel* numbers_;
};

}  // namespace fieldtrue::widgets
