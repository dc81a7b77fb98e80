#pragma once

#include <QWidget>
#include <map>

#include "widgets/pages/workbench.h"

class QToolButton;

namespace fieldtrue {

enum class StepState { kNotYet, kReady, kDone, kAttention };

/// The steps in order at the left edge, each with its state in shape and words. Any step can be opened.
class StepRail : public QWidget {
  Q_OBJECT
 public:
  explicit StepRail(QWidget* parent = nullptr);
  void setCurrent(Step step);
  void setState(Step step, StepState state, const QString& words);
  void refreshIcons();

 signals:
  void stepClicked(fieldtrue::Step step);

 private:
  struct Row {
    QToolButton* button = nullptr;
    QString icon;
    QString label;
    StepState state = StepState::kNotYet;
  };
  void draw(Row& row);
  std::map<Step, Row> rows_;
};

}  // namespace fieldtrue
