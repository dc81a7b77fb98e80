#include "widgets/pages/step_rail.h"

#include <QPainter>
#include <QPixmap>
#include <QToolButton>
#include <QVBoxLayout>
#include <array>

#include "widgets/views/theme.h"

namespace fieldtrue {
namespace {

struct StepText {
  Step step;
  const char* icon;
  const char* label;
};
constexpr std::array<StepText, 7> kSteps{{{Step::kStart, "home", QT_TRANSLATE_NOOP("StepRail", "Start")},
                                          {Step::kConnect, "connect", QT_TRANSLATE_NOOP("StepRail", "Connect")},
                                          {Step::kPlan, "plan", QT_TRANSLATE_NOOP("StepRail", "Plan")},
                                          {Step::kAcquire, "acquire", QT_TRANSLATE_NOOP("StepRail", "Acquire")},
                                          {Step::kCompare, "compare", QT_TRANSLATE_NOOP("StepRail", "Compare")},
                                          {Step::kGap, "gap", QT_TRANSLATE_NOOP("StepRail", "Gap")},
                                          {Step::kExport, "export", QT_TRANSLATE_NOOP("StepRail", "Export")}}};
constexpr int kIconSize = 28;

// Shape and colour together: hollow ring = not yet, dot = ready, tick = done, triangle = needs attention.
void drawBadge(QPainter& painter, const QRectF& box, StepState state) {
  painter.setRenderHint(QPainter::Antialiasing);
  const Theme& colors = theme();
  painter.setPen(QPen(colors.surface, 1.0));
  switch (state) {
    case StepState::kNotYet:
      return;
    case StepState::kReady:
      painter.setBrush(colors.accent);
      painter.drawEllipse(box.adjusted(2, 2, -2, -2));
      return;
    case StepState::kDone: {
      painter.setBrush(colors.done);
      painter.drawEllipse(box);
      painter.setPen(QPen(colors.surface, 1.6));
      painter.drawPolyline(QPolygonF(
          {box.topLeft() + QPointF(2.5, 6), box.topLeft() + QPointF(5, 8.5), box.topLeft() + QPointF(9.5, 3.5)}));
      return;
    }
    case StepState::kAttention:
      painter.setBrush(colors.attention);
      painter.drawPolygon(
          QPolygonF({box.topLeft() + QPointF(box.width() / 2, 0), box.bottomRight(), box.bottomLeft()}));
      return;
  }
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
  for (const StepText& text : kSteps) {
    auto* button = new QToolButton(this);
    button->setObjectName(QStringLiteral("step_") + stepId(text.step));
    button->setCheckable(true);
    button->setAutoExclusive(true);
    button->setToolButtonStyle(Qt::ToolButtonTextUnderIcon);
    button->setIconSize(QSize(kIconSize, kIconSize));
    button->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
    button->setShortcut(QKeySequence(Qt::ALT | (Qt::Key_0 + number++)));
    button->setFocusPolicy(Qt::TabFocus);
    connect(button, &QToolButton::clicked, this, [this, step = text.step] { emit stepClicked(step); });
    layout->addWidget(button);
    Row& row = rows_[text.step];
    row.button = button;
    row.icon = QLatin1String(text.icon);
    row.label = tr(text.label);
    button->setText(row.label);
    draw(row);
  }
  layout->addStretch();
}

void StepRail::setCurrent(Step step) { rows_.at(step).button->setChecked(true); }

void StepRail::setState(Step step, StepState state, const QString& words) {
  Row& row = rows_.at(step);
  row.button->setToolTip(words);
  row.button->setAccessibleName(words.isEmpty() ? row.label : tr("%1: %2").arg(row.label, words));
  if (row.state == state) return;
  row.state = state;
  draw(row);
}

void StepRail::refreshIcons() {
  for (auto& [step, row] : rows_) draw(row);
}

void StepRail::draw(Row& row) {
  const qreal ratio = devicePixelRatioF();
  QPixmap picture(QSize(kIconSize, kIconSize) * ratio);
  picture.setDevicePixelRatio(ratio);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  icon(row.icon).paint(&painter, QRect(2, 2, kIconSize - 4, kIconSize - 4));
  drawBadge(painter, QRectF(kIconSize - 12.5, 0.5, 12, 12), row.state);
  painter.end();
  row.button->setIcon(QIcon(picture));
}

}  // namespace fieldtrue
