#pragma once

#include <QWidget>
#include <map>

#include "widgets/shell/page_registry.h"

class QToolButton;

namespace fieldtrue::widgets {

/// The pages in order at the left edge, each with its state in shape and words. Any page can be opened.
class StepRail : public QWidget {
  Q_OBJECT
 public:
  explicit StepRail(QWidget* parent = nullptr);
  void setCurrent(const PageRow& page);
  void setMark(const PageRow& page, const PageMark& mark);
  void refreshIcons();

 signals:
  void pageClicked(const QString& id);
  void helpClicked();

 private:
  struct Entry {
    QToolButton* button = nullptr;
    PageState state = PageState::kNotYet;
  };
  QToolButton* makeHelpButton();
  void draw(const PageRow& page, const Entry& entry);
  std::map<const PageRow*, Entry> entries_;
};

}  // namespace fieldtrue::widgets
