#pragma once

#include <QWidget>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "widgets/workbench/workbench.h"

class QLabel;
class QProgressBar;
class QPushButton;
class QStackedWidget;
class QTableView;

namespace fieldtrue::widgets {

class HeldTake;
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
  void showEvent(QShowEvent* event) override;
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  QWidget* makeBanner();
  QWidget* makeInspector();
  QWidget* makeEmpty();
  QPushButton* addAction(const QString& name, const QString& label, const QString& icon_name, const QString& keys,
                         const std::function<void()>& action);
  void addShortcut(const QKeySequence& keys, const std::function<void()>& action);
  void onTakeKey();
  /// What the large button and its keys do: take the place, or go on to the comparison when all are done.
  void takeOrGoOn();
  void onSession();
  void onStatus(const acquisition::AcquisitionStatus& status);
  void showCurrentRow();
  void showPlace(const acquisition::AcquisitionStatus& status);
  void showDistance(const acquisition::AcquisitionStatus& status);
  /// Makes a long place's name smaller until all of it is read.
  void fitPlace();
  /// The same for a reason, which may have lines.
  void fitReason();
  void showRing(const acquisition::AcquisitionStatus& status);
  void showSensors(const acquisition::AcquisitionStatus& status);
  void showButtons(const acquisition::AcquisitionStatus& status);
  void fitText();

  Workbench& workbench_;
  QStackedWidget* stack_;
  QWidget* banner_;
  QLabel* place_;
  QLabel* position_;
  QLabel* reason_;
  HeldTake* held_;
  QLabel* to_go_;
  QLabel* to_go_caption_;
  SampleRing* ring_;
  RoomView* room_;
  QProgressBar* progress_;
  QLabel* counts_;
  QLabel* sensors_;  ///< How each is doing; to be seen only where several are recorded.
  QTableView* list_;
  PlaceListModel* model_;
  QPushButton* take_;
  QPushButton* skip_;
  QPushButton* undo_;
  QPushButton* redo_;
  QPushButton* retake_;
  QPushButton* automatic_;
  std::vector<acquisition::PlaceState> states_;
  std::optional<std::size_t> current_;
  std::optional<Pose> shown_reference_;  ///< Where the transmitter is drawn: it glides to a new guess.
};

}  // namespace fieldtrue::widgets
