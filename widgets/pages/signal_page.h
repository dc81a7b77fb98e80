#pragma once

#include <QTimer>
#include <QWidget>
#include <vector>

#include "acquisition/session/signal_snapshot.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/workbench.h"

class QGridLayout;
class QLabel;
class QPushButton;
class QStackedWidget;
class QTableWidget;

namespace fieldtrue::widgets {

class SketchView;
class SpectrumView;
struct Sketch;

/// What every sensor sends, and the questions that decide a day, each with a picture and an answer.
class SignalPage : public QWidget {
  Q_OBJECT
 public:
  explicit SignalPage(Workbench& workbench, QWidget* parent = nullptr);

 protected:
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;

 private:
  /// One question on screen.
  struct Card {
    SketchView* picture;
    QLabel* mark;
    QLabel* answer;
  };
  QWidget* makeContent();
  QWidget* makeHead(QWidget* parent);
  QWidget* makeCards(QWidget* parent);
  Card makeCard(const acquisition::SignalQuestion& question, QGridLayout& grid, int number);
  QWidget* makeInspector(QWidget* parent);
  void onStatus(const acquisition::AcquisitionStatus& status);
  void onSignal(const acquisition::SignalSnapshot& snapshot);
  void show(const std::vector<acquisition::JudgedSignal>& judged_signals);
  void showSensors();
  void showSensor();
  void showAnswers(const acquisition::JudgedSignal& signal);
  Sketch sketchOf(std::size_t question, const acquisition::JudgedSignal& signal) const;
  void beginMoves();
  /// The signal of the sensor that is chosen in the table; none where there is none.
  const acquisition::JudgedSignal* chosen() const;

  Workbench& workbench_;
  QTimer timer_;
  BackgroundJobs jobs_{this};
  std::vector<acquisition::JudgedSignal> signals_;
  acquisition::AxisMoves moves_;
  int moved_sensor_ = -1;  ///< The one whose moves are followed.
  QStackedWidget* stack_;
  QLabel* device_;
  QPushButton* save_;
  QTableWidget* sensors_;
  std::vector<Card> cards_;  ///< In the order of the questions.
  QPushButton* move_;
  SpectrumView* spectrum_;
  QLabel* numbers_;
};

}  // namespace fieldtrue::widgets
