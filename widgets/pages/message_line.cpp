#include "widgets/pages/message_line.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QStyle>
#include <QTimer>

#include "widgets/views/theme.h"

namespace fieldtrue {
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
  connect(fade_, &QTimer::timeout, this, &MessageLine::clear);
  connect(dismiss_, &QPushButton::clicked, this, &MessageLine::clear);
  connect(action_, &QPushButton::clicked, this, [this] {
    const auto action = message_.action;
    clear();
    if (action) action();
  });
  setMinimumHeight(36);
  clear();
}

void MessageLine::show(const Message& message) {
  message_ = message;
  text_->setText(message.text);
  text_->setAccessibleName(message.text);
  icon_->setPixmap(
      icon(message.severity == Severity::kInfo ? QStringLiteral("info") : QStringLiteral("warning")).pixmap(18, 18));
  icon_->setVisible(true);
  action_->setText(message.action_label);
  action_->setVisible(static_cast<bool>(message.action));
  dismiss_->setVisible(true);
  setProperty("severity", severityName(message.severity));
  style()->unpolish(this);
  style()->polish(this);
  if (message.severity == Severity::kInfo) {
    fade_->start(kFadeMs);
  } else {
    fade_->stop();
  }
}

void MessageLine::clearInformation() {
  if (message_.severity == Severity::kInfo) clear();
}

QString MessageLine::text() const { return message_.text; }

void MessageLine::clear() {
  fade_->stop();
  message_ = {};
  text_->clear();
  for (QWidget* part : {static_cast<QWidget*>(icon_), static_cast<QWidget*>(action_), static_cast<QWidget*>(dismiss_)})
    part->setVisible(false);
  setProperty("severity", QString());
  style()->unpolish(this);
  style()->polish(this);
}

}  // namespace fieldtrue
