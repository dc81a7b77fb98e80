#pragma once

#include <QString>
#include <QWidget>
#include <functional>
#include <vector>

namespace fieldtrue::widgets {

/// A step that has nothing to show yet: what is missing, and the buttons that provide it.
class EmptyPage : public QWidget {
  Q_OBJECT
 public:
  struct Action {
    QString label;
    std::function<void()> run;
  };
  EmptyPage(const QString& what_is_missing, const QString& what_to_do, const std::vector<Action>& actions,
            QWidget* parent = nullptr);
};

/// What a step shows while it is not known yet what an opened session holds.
EmptyPage* makeOpeningPage(QWidget* parent);

}  // namespace fieldtrue::widgets
