#pragma once

#include <QWidget>
#include <vector>

#include "widgets/workbench/workbench.h"

class QLabel;
class QPushButton;
class QTimer;

namespace fieldtrue::widgets {

/// One line for messages: what happened, what to do, an action button where there is one. The newest one is shown, and
/// behind it stand those whose condition still holds. Information fades after a while.
class MessageLine : public QWidget {
  Q_OBJECT
 public:
  explicit MessageLine(QWidget* parent = nullptr);
  void show(const Message& message);
  /// Takes away what was said of a condition and of those within it.
  void endCondition(const QString& condition);
  /// The person went to another page: information, and what belongs to no condition, goes.
  void leavePage();
  QString text() const;

 private:
  void dismiss();
  void display();
  template <class Condition>
  void removeIf(Condition condition);
  QLabel* icon_;
  QLabel* text_;
  QPushButton* action_;
  QPushButton* dismiss_;
  QTimer* fade_;
  std::vector<Message> messages_;  ///< Oldest first; the last is shown.
};

}  // namespace fieldtrue::widgets
