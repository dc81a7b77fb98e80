#pragma once

#include <QWidget>

#include "acquisition/session/acquisition_controller.h"

class QPushButton;

namespace fieldtrue::widgets {

class Workbench;

/// What becomes of a take whose time is over: four large buttons, to be seen only while one is held.
class HeldTake : public QWidget {
  Q_OBJECT
 public:
  HeldTake(Workbench& workbench, QWidget* parent);
  void setLetters(int pixels);  ///< Their height, where there is room for it.

  /// What the key does that takes a place: it keeps, or waits longer where there is nothing to keep.
  /// @return whether a take was held
  bool takeKey();
  bool waitKey();   ///< @return whether a take was held
  bool againKey();  ///< @return whether a take was held

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  void onStatus(const acquisition::AcquisitionStatus& status);
  QPushButton* makeButton(const QString& name, const QString& label);
  bool isHeld() const;
  void fit();

  Workbench& workbench_;
  QPushButton* keep_;
  QPushButton* wait_;
  QPushButton* again_;
  QPushButton* skip_;
  int letters_ = 12;
};

}  // namespace fieldtrue::widgets
