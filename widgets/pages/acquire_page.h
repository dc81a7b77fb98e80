#pragma once

#include <QWidget>
#include <vector>

#include "widgets/pages/workbench.h"

class QLabel;
class QProgressBar;
class QPushButton;
class QStackedWidget;
class QTableView;

namespace fieldtrue {

class PlaceListModel;
class RoomView;
class SampleRing;

/// The page an operator works from, metres away: where to put the sensor in huge letters, why it waits, a ring that
/// fills with samples, and the room with the next place in it.
class AcquirePage : public QWidget {
  Q_OBJECT
 public:
  explicit AcquirePage(Workbench& workbench, QWidget* parent = nullptr);

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  QWidget* makeBanner();
  QWidget* makeInspector();
  QWidget* makeEmpty();
  QPushButton* addAction(const QString& name, const QString& label, const QString& icon_name, const QString& keys,
                         std::function<void()> action);
  void addShortcut(const QKeySequence& keys, std::function<void()> action);
  void onSession();
  void onStatus(const AcquisitionStatus& status);
  void showPlace(const AcquisitionStatus& status);
  void showRing(const AcquisitionStatus& status);
  void showButtons(const AcquisitionStatus& status);
  void fitText();

  Workbench& workbench_;
  QStackedWidget* stack_;
  QWidget* banner_;
  QLabel* place_;
  QLabel* position_;
  QLabel* reason_;
  SampleRing* ring_;
  RoomView* room_;
  QProgressBar* progress_;
  QLabel* counts_;
  QTableView* list_;
  PlaceListModel* model_;
  QPushButton* take_;
  QPushButton* skip_;
  QPushButton* undo_;
  QPushButton* redo_;
  QPushButton* retake_;
  QPushButton* automatic_;
  std::vector<PlaceState> states_;
  std::optional<std::size_t> current_;
};

}  // namespace fieldtrue
