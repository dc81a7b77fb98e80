#pragma once

#include <QWidget>

#include "widgets/pages/workbench.h"

class QLabel;
class QPushButton;
class QTimer;

namespace fieldtrue {

/// One line for messages: what happened, what to do, an action button where there is one. Information fades after a
/// while; anything that needs attention stays until the next message or until it is dismissed.
class MessageLine : public QWidget {
  Q_OBJECT
 public:
  explicit MessageLine(QWidget* parent = nullptr);
  void show(const Message& message);
  /// Drops a mere piece of information: the person went on. What needs attention stays.
  void clearInformation();
  QString text() const;

 private:
  void clear();
  QLabel* icon_;
  QLabel* text_;
  QPushButton* action_;
  QPushButton* dismiss_;
  QTimer* fade_;
  Message message_;
};

}  // namespace fieldtrue
