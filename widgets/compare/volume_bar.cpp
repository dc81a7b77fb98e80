#include "widgets/compare/volume_bar.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QSlider>
#include <QVBoxLayout>

#include "widgets/forms/number_box.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kSliceSteps = 100;
constexpr int kSliceWidth = 72;  // Least [px]: below it a knob is all that shows.
constexpr int kLetters = 8;      // A list shows at least, so that the bar takes nothing from the words beside it.
constexpr double kLeastIso_mm = 0.01;
constexpr double kMostIso_mm = 2000.0;

}  // namespace

VolumeBar::VolumeBar(QWidget* parent)
    : QWidget(parent),
      quantity_(new QComboBox(this)),
      held_(new QComboBox(this)),
      show_slice_(new QCheckBox(tr("Slice"), this)),
      axis_(new QComboBox(this)),
      position_(new QSlider(Qt::Horizontal, this)),
      position_text_(new QLabel(this)),
      show_iso_(new QCheckBox(tr("Surface at"), this)),
      iso_(new NumberBox(this)),
      text_(new QLabel(this)) {
  setObjectName(QStringLiteral("volumeBar"));
  connect(&placingUnitNotifier(), &PlacingUnitNotifier::placingUnitChanged, this, &VolumeBar::showState);
  setAttribute(Qt::WA_StyledBackground);
  quantity_->setObjectName(QStringLiteral("volumeQuantity"));
  quantity_->setAccessibleName(tr("What is drawn between the places"));
  for (const auto& [label, quantity] : {std::pair(tr("Places only"), VolumeQuantity::kNone),
                                        std::pair(tr("Expected error"), VolumeQuantity::kExpectedError),
                                        std::pair(tr("Size of the correction"), VolumeQuantity::kCorrection),
                                        std::pair(tr("Stated uncertainty"), VolumeQuantity::kUncertainty)})
    quantity_->addItem(label, static_cast<int>(quantity));
  connect(quantity_, &QComboBox::currentIndexChanged, this, [this] {
    showState();
    emit quantityChanged();
  });
  held_->setObjectName(QStringLiteral("volumeHeld"));
  held_->setAccessibleName(tr("How the sensor is held"));
  held_->setToolTip(tr("How the sensor is held, for corrections that take orientation: azimuth, elevation, roll"));
  held_->hide();
  connect(held_, &QComboBox::currentIndexChanged, this, &VolumeBar::quantityChanged);
  for (QComboBox* list : {quantity_, held_}) {
    list->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    list->setMinimumContentsLength(kLetters);
  }
  makeSlice();
  makeIso();
  auto* row = new QHBoxLayout;
  row->addWidget(quantity_, 2);
  row->addWidget(held_, 2);
  row->addWidget(show_slice_);
  row->addWidget(axis_);
  row->addWidget(position_, 1);
  row->addWidget(position_text_);
  row->addWidget(show_iso_);
  row->addWidget(iso_);
  text_->setObjectName(QStringLiteral("volumeText"));
  text_->setProperty("role", "muted");
  text_->setWordWrap(true);
  auto* rows = new QVBoxLayout(this);
  rows->setContentsMargins(12, 4, 12, 4);
  rows->setSpacing(4);
  rows->addLayout(row);
  rows->addWidget(text_);
  showState();
}

void VolumeBar::makeSlice() {
  show_slice_->setObjectName(QStringLiteral("sliceShown"));
  show_slice_->setChecked(true);
  axis_->setObjectName(QStringLiteral("sliceAxis"));
  axis_->setAccessibleName(tr("Axis the plane stands across"));
  for (const char* name : {"x", "y", "z"}) axis_->addItem(QString::fromLatin1(name));
  axis_->setCurrentIndex(2);
  position_->setObjectName(QStringLiteral("slicePosition"));
  position_->setAccessibleName(tr("Where the plane stands"));
  position_->setRange(0, kSliceSteps);
  position_->setValue(kSliceSteps / 2);
  position_->setPageStep(10);
  position_->setMinimumWidth(kSliceWidth);
  position_text_->setMinimumWidth(72);
  const auto moved = [this] {
    showState();
    emit sliceChanged();
  };
  connect(show_slice_, &QCheckBox::toggled, this, moved);
  connect(axis_, &QComboBox::currentIndexChanged, this, moved);
  connect(position_, &QSlider::valueChanged, this, moved);
}

void VolumeBar::makeIso() {
  show_iso_->setObjectName(QStringLiteral("isoShown"));
  iso_->setObjectName(QStringLiteral("isoValue"));
  iso_->setAccessibleName(tr("Value of the surface"));
  iso_->setRange(kLeastIso_mm, kMostIso_mm);
  iso_->setDecimals(2);
  iso_->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
  iso_->setSuffix(tr(" mm"));
  iso_->setValue(5.0);
  iso_->setKeyboardTracking(false);
  connect(show_iso_, &QCheckBox::toggled, this, [this] {
    showState();
    emit isoChanged();
  });
  connect(iso_, &QDoubleSpinBox::valueChanged, this, [this] {
    iso_by_hand_ = true;
    emit isoChanged();
  });
}

VolumeQuantity VolumeBar::quantity() const { return static_cast<VolumeQuantity>(quantity_->currentData().toInt()); }

void VolumeBar::setWaysHeld(const std::vector<Eigen::Quaterniond>& ways) {
  const QSignalBlocker quiet(held_);
  held_->clear();
  held_->addItem(tr("Mean of all turns"), kMeanHeld);
  for (std::size_t i = 0; i < ways.size(); ++i)
    held_->addItem(tr("Turned by %1").arg(shortTurnText(ways[i])), static_cast<int>(i));
  held_->setVisible(ways.size() > 1);
}

int VolumeBar::held() const { return held_->count() == 0 ? kMeanHeld : held_->currentData().toInt(); }

void VolumeBar::setQuantity(VolumeQuantity quantity) {
  quantity_->setCurrentIndex(quantity_->findData(static_cast<int>(quantity)));
}

void VolumeBar::setDifference(bool difference) {
  difference_ = difference;
  quantity_->setToolTip(difference ? tr("In a difference: the distance between the two corrected positions")
                                   : QString());
}

void VolumeBar::setLattice(const VolumeField& lattice) {
  lattice_ = lattice;
  showState();
}

double VolumeBar::position_m() const {
  const int axis = axis_->currentIndex();
  const double share = position_->value() / static_cast<double>(kSliceSteps);
  return lattice_.low_m[axis] + share * (lattice_.high_m()[axis] - lattice_.low_m[axis]);
}

std::optional<SlicePlane> VolumeBar::slice() const {
  if (quantity() == VolumeQuantity::kNone || !show_slice_->isChecked() || lattice_.empty()) return std::nullopt;
  return SlicePlane{axis_->currentIndex(), position_m()};
}

std::optional<double> VolumeBar::iso_mm() const {
  if (quantity() == VolumeQuantity::kNone || !show_iso_->isChecked()) return std::nullopt;
  return iso_->value();
}

void VolumeBar::suggestIso_mm(double value_mm) {
  if (iso_by_hand_) return;
  const QSignalBlocker quiet(iso_);
  iso_->setValue(value_mm);
}

void VolumeBar::setText(const QString& text) {
  text_->setText(text);
  text_->setVisible(!text.isEmpty());
}

QString VolumeBar::text() const { return text_->text(); }

void VolumeBar::showState() {
  const bool on = quantity() != VolumeQuantity::kNone;
  show_slice_->setEnabled(on);
  held_->setEnabled(quantity() == VolumeQuantity::kCorrection || quantity() == VolumeQuantity::kUncertainty);
  show_iso_->setEnabled(on);
  for (QWidget* widget : {static_cast<QWidget*>(axis_), static_cast<QWidget*>(position_)})
    widget->setEnabled(on && show_slice_->isChecked());
  iso_->setEnabled(on && show_iso_->isChecked());
  position_text_->setText(on && !lattice_.empty() ? coordinateText(position_m()) : QString());
}

}  // namespace fieldtrue::widgets
