#include "widgets/shell/message_line.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QStyle>
#include <QTimer>

#include "widgets/style/icons.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kFadeMs = 12000;

QString severityName(Severity severity) {
  switch (severity) {
    case Severity::kInfo:
      return QStringLiteral("info");
    case Severity::kAttention:
      return QStringLiteral("attention");
    case Severity::kDanger:
      return QStringLiteral("danger");
  }
  return {};
}

}  // namespace

MessageLine::MessageLine(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("messageLine"));
  setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(12, 4, 8, 4);
  icon_ = new QLabel(this);
  text_ = new QLabel(this);
  text_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  text_->setWordWrap(true);
  action_ = new QPushButton(this);
  dismiss_ = new QPushButton(tr("Dismiss"), this);
  dismiss_->setFlat(true);
  for (QPushButton* button : {action_, dismiss_}) button->setFocusPolicy(Qt::TabFocus);
  layout->addWidget(icon_);
  layout->addWidget(text_, 1);
  layout->addWidget(action_);
  layout->addWidget(dismiss_);
  fade_ = new QTimer(this);
  fade_->setSingleShot(true);
  connect(fade_, &QTimer::timeout, this, &MessageLine::dismiss);
  connect(dismiss_, &QPushButton::clicked, this, &MessageLine::dismiss);
  connect(action_, &QPushButton::clicked, this, [this] {
    if (messages_.empty()) return;
    const auto action = messages_.back().action;
    dismiss();
    if (action) action();
  });
  setMinimumHeight(36);
  display();
}

template <class Condition>
void MessageLine::removeIf(Condition condition) {
  if (std::erase_if(messages_, condition) > 0) display();
}

void MessageLine::show(const Message& message) {
  std::erase_if(messages_, [&message](const Message& old) {
    return old.condition.isEmpty() || old.condition == message.condition;
  });
  messages_.push_back(message);
  display();
}

void MessageLine::endCondition(const QString& condition) {
  removeIf([&condition](const Message& message) {
    return message.condition == condition || message.condition.startsWith(condition + QLatin1Char('/'));
  });
}

void MessageLine::leavePage() {
  removeIf([](const Message& message) { return message.condition.isEmpty() || message.severity == Severity::kInfo; });
}

void MessageLine::dismiss() {
  if (!messages_.empty()) messages_.pop_back();
  display();
}

QString MessageLine::text() const { return messages_.empty() ? QString() : messages_.back().text; }

void MessageLine::display() {
  const Message message = messages_.empty() ? Message() : messages_.back();
  const bool said = !messages_.empty();
  text_->setText(message.text);
  text_->setToolTip(message.text);
  text_->setAccessibleName(message.text);
  icon_->setPixmap(
      icon(message.severity == Severity::kInfo ? QStringLiteral("info") : QStringLiteral("warning")).pixmap(18, 18));
  icon_->setVisible(said);
  action_->setText(message.action_label);
  action_->setVisible(static_cast<bool>(message.action));
  dismiss_->setVisible(said);
  setStyled(*this, "severity", said ? severityName(message.severity) : QString());
  if (said && message.severity == Severity::kInfo) {
    fade_->start(kFadeMs);
  } else {
    fade_->stop();
  }
}

}  // namespace fieldtrue::widgets
