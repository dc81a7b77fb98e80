#include "widgets/shell/step_rail.h"

#include <QPainter>
#include <QPixmap>
#include <QToolButton>
#include <QVBoxLayout>

#include "widgets/style/icons.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kIconSize = 28;
// Room at the left of the symbol for the digit that opens the step with Alt.
constexpr int kDigitWidth = 10;
constexpr int kPictureWidth = kIconSize + 2 * kDigitWidth;

// Shape and colour together: hollow ring = not yet, dot = ready, tick = done, triangle = needs attention.
void drawBadge(QPainter& painter, const QRectF& box, PageState state) {
  painter.setRenderHint(QPainter::Antialiasing);
  const Theme& colors = theme();
  painter.setPen(QPen(colors.surface, 1.0));
  switch (state) {
    case PageState::kNotYet:
      return;
    case PageState::kReady:
      painter.setBrush(colors.accent);
      painter.drawEllipse(box.adjusted(2, 2, -2, -2));
      return;
    case PageState::kDone: {
      painter.setBrush(colors.done);
      painter.drawEllipse(box);
      painter.setPen(QPen(colors.surface, 1.6));
      painter.drawPolyline(QPolygonF(
          {box.topLeft() + QPointF(2.5, 6), box.topLeft() + QPointF(5, 8.5), box.topLeft() + QPointF(9.5, 3.5)}));
      return;
    }
    case PageState::kAttention:
      painter.setBrush(colors.attention);
      painter.drawPolygon(
          QPolygonF({box.topLeft() + QPointF(box.width() / 2, 0), box.bottomRight(), box.bottomLeft()}));
      return;
  }
}

/// The key that opens the step with Alt, small and quiet beside the symbol.
void drawDigit(QPainter& painter, const QKeySequence& keys) {
  QFont font = painter.font();
  font.setPixelSize(10);
  painter.setFont(font);
  painter.setPen(theme().text_muted);
  painter.drawText(QRectF(0, 0, kDigitWidth, 12), Qt::AlignLeft | Qt::AlignTop, keys.toString().right(1));
}

}  // namespace

StepRail::StepRail(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("stepRail"));
  setAttribute(Qt::WA_StyledBackground);
  setFixedWidth(96);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(8, 12, 8, 12);
  layout->setSpacing(4);
  int number = 0;
  for (const PageRow& page : pageRows()) {
    auto* button = new QToolButton(this);
    button->setObjectName(QStringLiteral("step_") + QLatin1String(page.id));
    button->setCheckable(true);
    button->setAutoExclusive(true);
    button->setToolButtonStyle(Qt::ToolButtonTextUnderIcon);
    button->setIconSize(QSize(kPictureWidth, kIconSize));
    button->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
    button->setFocusPolicy(Qt::TabFocus);
    connect(button, &QToolButton::clicked, this, [this, &page] { emit pageClicked(QLatin1String(page.id)); });
    layout->addWidget(button);
    button->setText(tr(page.label));
    // After the text: setting a button's text replaces its shortcut by the text's own.
    button->setShortcut(QKeySequence(Qt::ALT | (Qt::Key_0 + number++)));
    entries_[&page].button = button;
    setMark(page, {});
    draw(page, entries_[&page]);
  }
  layout->addStretch();
  layout->addWidget(makeHelpButton());
}

QToolButton* StepRail::makeHelpButton() {
  auto* button = new QToolButton(this);
  button->setObjectName(QStringLiteral("helpButton"));
  button->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  button->setIcon(icon(QStringLiteral("help")));
  button->setIconSize(QSize(18, 18));
  button->setText(tr("Help"));
  button->setToolTip(tr("The guide, at the page of this step (F1)"));
  button->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  button->setFocusPolicy(Qt::TabFocus);
  connect(button, &QToolButton::clicked, this, &StepRail::helpClicked);
  return button;
}

void StepRail::setCurrent(const PageRow& page) { entries_.at(&page).button->setChecked(true); }

void StepRail::setMark(const PageRow& page, const PageMark& mark) {
  Entry& entry = entries_.at(&page);
  const QString label = tr(page.label);
  const QString keys = entry.button->shortcut().toString(QKeySequence::NativeText);
  entry.button->setToolTip(mark.words.isEmpty() ? tr("%1 (%2)").arg(label, keys)
                                                : tr("%1: %2 (%3)").arg(label, mark.words, keys));
  entry.button->setAccessibleName(mark.words.isEmpty() ? label : tr("%1: %2").arg(label, mark.words));
  if (entry.state == mark.state) return;
  entry.state = mark.state;
  draw(page, entry);
}

void StepRail::refreshIcons() {
  for (const auto& [page, entry] : entries_) draw(*page, entry);
}

void StepRail::draw(const PageRow& page, const Entry& entry) {
  const qreal ratio = devicePixelRatioF();
  QPixmap picture(QSize(kPictureWidth, kIconSize) * ratio);
  picture.setDevicePixelRatio(ratio);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  icon(QLatin1String(page.icon)).paint(&painter, QRect(kDigitWidth + 2, 2, kIconSize - 4, kIconSize - 4));
  drawDigit(painter, entry.button->shortcut());
  drawBadge(painter, QRectF(kDigitWidth + kIconSize - 12.5, 0.5, 12, 12), entry.state);
  painter.end();
  entry.button->setIcon(QIcon(picture));
}

}  // namespace fieldtrue::widgets
