#include "widgets/forms/held_take.h"

#include <QHBoxLayout>
#include <QPushButton>
#include <QResizeEvent>
#include <algorithm>

#include "widgets/style/theme.h"
#include "widgets/workbench/workbench.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kSmallest = 12;  ///< Pixels, of letters.
constexpr int kSpacing = 12;

}  // namespace

HeldTake::HeldTake(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  setObjectName(QStringLiteral("heldTake"));
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 8, 0, 4);
  row->setSpacing(kSpacing);
  keep_ = makeButton(QStringLiteral("keepTake"), tr("Keep it (Space)"));
  keep_->setToolTip(tr("What it has is stored, and marked (Space or Page Down)"));
  wait_ = makeButton(QStringLiteral("waitLonger"), tr("Wait longer (W)"));
  wait_->setToolTip(tr("It goes on with what it has, for as long again (W or Page Up)"));
  again_ = makeButton(QStringLiteral("takeAgain"), tr("Take again (R)"));
  again_->setToolTip(tr("What it has is left out, and the take begins anew (R)"));
  skip_ = makeButton(QStringLiteral("skipHeld"), tr("Skip (S)"));
  skip_->setToolTip(tr("What it has is left out, and the place is skipped (S)"));
  for (QPushButton* button : {keep_, wait_, again_, skip_}) row->addWidget(button);
  row->addStretch();
  // Wide letters shrink; they do not hold the window wide.
  setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  connect(keep_, &QPushButton::clicked, &workbench_, &Workbench::keepTake);
  connect(wait_, &QPushButton::clicked, &workbench_, &Workbench::waitLonger);
  connect(again_, &QPushButton::clicked, &workbench_, &Workbench::takeAgain);
  connect(skip_, &QPushButton::clicked, &workbench_, &Workbench::skip);
  hide();
  connect(&workbench_, &Workbench::statusChanged, this, &HeldTake::onStatus);
}

QPushButton* HeldTake::makeButton(const QString& name, const QString& label) {
  auto* button = new QPushButton(label, this);
  button->setObjectName(name);
  button->setFocusPolicy(Qt::TabFocus);
  return button;
}

void HeldTake::setLetters(int pixels) {
  letters_ = std::max(kSmallest, pixels);
  fit();
}

void HeldTake::fit() {
  const auto widthWith = [this](int pixels) {
    int wide = -kSpacing;
    for (QPushButton* button : {keep_, wait_, again_, skip_}) {
      QFont font = button->font();
      font.setPixelSize(pixels);
      button->setFont(font);
      wide += button->sizeHint().width() + kSpacing;
    }
    return wide;
  };
  int pixels = letters_;
  while (widthWith(pixels) > width() && pixels > kSmallest) --pixels;
}

void HeldTake::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fit();
}

bool HeldTake::isHeld() const { return workbench_.status().take == acquisition::TakeState::kHeld; }

bool HeldTake::takeKey() {
  if (!isHeld()) return false;
  if (workbench_.status().can_keep)
    workbench_.keepTake();
  else
    workbench_.waitLonger();
  return true;
}

bool HeldTake::waitKey() {
  if (isHeld()) workbench_.waitLonger();
  return isHeld();
}

bool HeldTake::againKey() {
  if (isHeld()) workbench_.takeAgain();
  return isHeld();
}

void HeldTake::onStatus(const acquisition::AcquisitionStatus& status) {
  setVisible(status.take == acquisition::TakeState::kHeld);
  keep_->setEnabled(status.can_keep);
  keep_->setText(status.can_keep ? tr("Keep it (Space)") : tr("Nothing to keep"));
  wait_->setText(status.can_keep ? tr("Wait longer (W)") : tr("Wait longer (Space)"));
  // What the space bar does is what most will want.
  const bool changed = setStyled(*keep_, "primary", status.can_keep);
  if (setStyled(*wait_, "primary", !status.can_keep) || changed) fit();
}

}  // namespace fieldtrue::widgets
