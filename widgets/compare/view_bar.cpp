#include "widgets/compare/view_bar.h"

#include <QButtonGroup>
#include <QCheckBox>
#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QSlider>
#include <cmath>
#include <tuple>

#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kSteps = 150;

// The slider runs over magnifications 1 to 1000 in even ratios.
double magnificationOf(int slider) { return std::pow(10.0, slider / 50.0); }
int sliderOf(double magnification) { return static_cast<int>(std::lround(50.0 * std::log10(magnification))); }

}  // namespace

ViewBar::ViewBar(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("viewBar"));
  setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(12, 4, 12, 4);
  makeModes(layout);
  layout->addSpacing(8);
  makeArrows(layout);
  makeChecks(layout);
  makeCamera(layout);
}

void ViewBar::makeModes(QHBoxLayout* layout) {
  modes_ = new QButtonGroup(this);
  const std::tuple<QString, Mode, const char*> modes[] = {{tr("Two"), Mode::kSideBySide, "modeTwo"},
                                                          {tr("One"), Mode::kOne, "modeOne"},
                                                          {tr("Difference"), Mode::kDifference, "modeDifference"}};
  for (const auto& [label, mode, name] : modes) {
    auto* button = new QPushButton(label, this);
    button->setObjectName(QString::fromLatin1(name));
    button->setCheckable(true);
    button->setProperty("segment", true);
    modes_->addButton(button, static_cast<int>(mode));
    layout->addWidget(button);
  }
  setMode(Mode::kSideBySide);
  connect(modes_, &QButtonGroup::idToggled, this, [this](int, bool on) {
    if (on) emit modeChanged();
  });
}

void ViewBar::makeArrows(QHBoxLayout* layout) {
  layout->addWidget(new QLabel(tr("Arrows"), this));
  arrows_ = new QSlider(Qt::Horizontal, this);
  arrows_->setObjectName(QStringLiteral("glyphScale"));
  arrows_->setRange(0, kSteps);
  arrows_->setMinimumWidth(60);
  arrows_->setAccessibleName(tr("Magnification of the arrows"));
  arrows_text_ = new QLabel(this);
  arrows_text_->setMinimumWidth(44);
  connect(arrows_, &QSlider::valueChanged, this, [this](int value) {
    factor_ = magnificationOf(value) / suited_;
    show(magnificationOf(value));
  });
  layout->addWidget(arrows_, 1);
  layout->addWidget(arrows_text_);
}

void ViewBar::makeChecks(QHBoxLayout* layout) {
  auto* turns = new QCheckBox(tr("Turns"), this);
  turns->setObjectName(QStringLiteral("showOrientation"));
  turns->setToolTip(tr("Draw the orientation error as arcs"));
  connect(turns, &QCheckBox::toggled, this, &ViewBar::turnsShown);
  certainty_ = new QCheckBox(tr("Certainty"), this);
  certainty_->setObjectName(QStringLiteral("showCertainty"));
  certainty_->setToolTip(tr("Fade the arrows where the method states a large uncertainty"));
  connect(certainty_, &QCheckBox::toggled, this, &ViewBar::certaintyChanged);
  layout->addWidget(turns);
  layout->addWidget(certainty_);
}

void ViewBar::makeCamera(QHBoxLayout* layout) {
  auto* camera = new QComboBox(this);
  camera->setObjectName(QStringLiteral("camera"));
  camera->setAccessibleName(tr("Where to look from"));
  for (const auto& [label, preset] :
       {std::pair(tr("Operator"), CameraPreset::kOperator), std::pair(tr("Front"), CameraPreset::kFront),
        std::pair(tr("Side"), CameraPreset::kSide), std::pair(tr("Top"), CameraPreset::kTop)})
    camera->addItem(label, static_cast<int>(preset));
  connect(camera, &QComboBox::activated, this,
          [this, camera] { emit cameraChosen(static_cast<CameraPreset>(camera->currentData().toInt())); });
  layout->addWidget(camera);
}

ViewBar::Mode ViewBar::mode() const { return static_cast<Mode>(modes_->checkedId()); }
void ViewBar::setMode(Mode mode) { modes_->button(static_cast<int>(mode))->setChecked(true); }
bool ViewBar::certaintyShown() const { return certainty_->isChecked(); }

void ViewBar::suitMagnification(double magnification) {
  suited_ = magnification;
  const QSignalBlocker quiet(arrows_);
  arrows_->setValue(sliderOf(suited_ * factor_));
  show(factor_ == 1.0 ? suited_ : magnificationOf(arrows_->value()));
}

void ViewBar::show(double magnification) {
  arrows_text_->setText(tr("\u00d7%1").arg(threeFigures(magnification)));
  emit magnified(magnification);
}

}  // namespace fieldtrue::widgets
