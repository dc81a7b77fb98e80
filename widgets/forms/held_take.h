#pragma once

#include <QWidget>

#include "acquisition/session/acquisition_controller.h"

class QPushButton;

namespace fieldtrue::widgets {

class Workbench;

/// What becomes of a take whose time is over: three large buttons, to be seen only while one is held.
class HeldTake : public QWidget {
  Q_OBJECT
 public:
  HeldTake(Workbench& workbench, QWidget* parent);
  void setLetters(int pixels);  ///< Their height.

  /// What the key does that takes a place: it keeps, or waits longer where there is nothing to keep.
  /// @return whether a take was held
  bool takeKey();
  bool waitKey();   ///< @return whether a take was held
  bool againKey();  ///< @return whether a take was held

 private:
  void onStatus(const acquisition::AcquisitionStatus& status);
  QPushButton* makeButton(const QString& name, const QString& label);
  bool isHeld() const;

  Workbench& workbench_;
  QPushButton* keep_;
  QPushButton* wait_;
  QPushButton* again_;
};

}  // namespace fieldtrue::widgets
