#include "widgets/forms/empty_page.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

namespace fieldtrue::widgets {

EmptyPage::EmptyPage(const QString& what_is_missing, const QString& what_to_do, const std::vector<Action>& actions,
                     QWidget* parent)
    : QWidget(parent) {
  auto* layout = new QVBoxLayout(this);
  layout->setSpacing(12);
  layout->addStretch();
  auto* title = new QLabel(what_is_missing, this);
  title->setProperty("role", "title");
  auto* advice = new QLabel(what_to_do, this);
  advice->setProperty("role", "muted");
  for (QLabel* label : {title, advice}) {
    label->setAlignment(Qt::AlignCenter);
    label->setWordWrap(true);
    layout->addWidget(label);
  }
  auto* buttons = new QHBoxLayout;
  buttons->addStretch();
  bool first = true;
  for (const Action& action : actions) {
    auto* button = new QPushButton(action.label, this);
    button->setProperty("primary", first);
    first = false;
    connect(button, &QPushButton::clicked, this, [run = action.run] { run(); });
    buttons->addWidget(button);
  }
  buttons->addStretch();
  layout->addLayout(buttons);
  layout->addStretch();
}

EmptyPage* makeOpeningPage(QWidget* parent) {
  return new EmptyPage(EmptyPage::tr("Opening the session..."), EmptyPage::tr("What was taken is being read."), {},
                       parent);
}

}  // namespace fieldtrue::widgets
