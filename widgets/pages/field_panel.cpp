#include "widgets/pages/field_panel.h"

#include <QButtonGroup>
#include <QCheckBox>
#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QSlider>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

#include "calib/core/statistics.h"
#include "widgets/pages/field_scales.h"
#include "widgets/pages/fitted_methods.h"
#include "widgets/pages/units.h"
#include "widgets/pages/volume_bar.h"
#include "widgets/pages/volume_store.h"
#include "widgets/views/field_scale.h"
#include "widgets/views/field_view.h"

namespace fieldtrue {
namespace {

constexpr int kBefore = -1;
constexpr double kColorEnds_mm[] = {0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200};

// The slider runs over magnifications 1 to 1000 in even ratios.
double magnificationOf(int slider) { return std::pow(10.0, slider / 50.0); }
int sliderOf(double magnification) { return static_cast<int>(std::lround(50.0 * std::log10(magnification))); }

MethodRow rowOf(const QComboBox* choice) {
  const QVariant data = choice->currentData();
  if (!data.isValid() || data.toInt() == kBefore) return std::nullopt;
  return static_cast<std::size_t>(data.toInt());
}

void chooseRow(QComboBox* choice, MethodRow row) {
  const int index = choice->findData(row ? static_cast<int>(*row) : kBefore);
  if (index >= 0) choice->setCurrentIndex(index);
}

}  // namespace

FieldPanel::FieldPanel(FittedMethods& fitted, VolumeStore& volumes, QWidget* parent)
    : QWidget(parent), fitted_(fitted), volumes_(volumes) {
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(0);
  layout->addWidget(makeViewBar());
  layout->addWidget(makeChoosers());
  layout->addWidget(makeViews(), 1);
  layout->addWidget(makeLegend());
  volume_bar_ = new VolumeBar(this);
  layout->addWidget(volume_bar_);
  connect(volume_bar_, &VolumeBar::quantityChanged, this, &FieldPanel::draw);
  connect(volume_bar_, &VolumeBar::sliceChanged, this, &FieldPanel::drawSlice);
  connect(volume_bar_, &VolumeBar::isoChanged, this, &FieldPanel::drawSlice);
  connect(&volumes_, &VolumeStore::changed, this, &FieldPanel::draw);
}

QWidget* FieldPanel::makeViewBar() {
  auto* bar = new QWidget(this);
  bar->setObjectName(QStringLiteral("viewBar"));
  bar->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(bar);
  layout->setContentsMargins(12, 4, 12, 4);
  makeModes(layout);
  layout->addSpacing(8);
  makeArrows(layout);
  orientation_ = new QCheckBox(tr("Turns"), bar);
  orientation_->setObjectName(QStringLiteral("showOrientation"));
  orientation_->setToolTip(tr("Draw the orientation error as arcs"));
  connect(orientation_, &QCheckBox::toggled, this, [this](bool on) {
    left_->setShowOrientation(on);
    right_->setShowOrientation(on);
  });
  certainty_ = new QCheckBox(tr("Certainty"), bar);
  certainty_->setObjectName(QStringLiteral("showCertainty"));
  certainty_->setToolTip(tr("Fade the arrows where the method states a large uncertainty"));
  connect(certainty_, &QCheckBox::toggled, this, &FieldPanel::draw);
  layout->addWidget(orientation_);
  layout->addWidget(certainty_);
  makeCamera(layout);
  return bar;
}

void FieldPanel::makeModes(QHBoxLayout* layout) {
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
  modes_->button(static_cast<int>(Mode::kSideBySide))->setChecked(true);
  connect(modes_, &QButtonGroup::idToggled, this, [this](int, bool on) {
    if (!on) return;
    draw();
    emit shownChanged();
  });
}

void FieldPanel::makeArrows(QHBoxLayout* layout) {
  layout->addWidget(new QLabel(tr("Arrows"), this));
  arrows_ = new QSlider(Qt::Horizontal, this);
  arrows_->setObjectName(QStringLiteral("glyphScale"));
  arrows_->setRange(0, 150);
  arrows_->setMinimumWidth(60);
  arrows_->setAccessibleName(tr("Magnification of the arrows"));
  arrows_text_ = new QLabel(this);
  arrows_text_->setMinimumWidth(44);
  connect(arrows_, &QSlider::valueChanged, this, [this](int value) {
    arrows_factor_ = magnificationOf(value) / suited_magnification_;
    magnify(magnificationOf(value));
  });
  layout->addWidget(arrows_, 1);
  layout->addWidget(arrows_text_);
}

void FieldPanel::makeCamera(QHBoxLayout* layout) {
  auto* camera = new QComboBox(this);
  camera->setObjectName(QStringLiteral("camera"));
  camera->setAccessibleName(tr("Where to look from"));
  for (const auto& [label, preset] :
       {std::pair(tr("Operator"), CameraPreset::kOperator), std::pair(tr("Front"), CameraPreset::kFront),
        std::pair(tr("Side"), CameraPreset::kSide), std::pair(tr("Top"), CameraPreset::kTop)})
    camera->addItem(label, static_cast<int>(preset));
  connect(camera, &QComboBox::activated, this,
          [this, camera] { right_->setCamera(static_cast<CameraPreset>(camera->currentData().toInt())); });
  layout->addWidget(camera);
}

QWidget* FieldPanel::makeChoosers() {
  auto* bar = new QWidget(this);
  bar->setObjectName(QStringLiteral("chooserBar"));
  bar->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(bar);
  layout->setContentsMargins(12, 4, 12, 4);
  left_choice_ = new QComboBox(bar);
  right_choice_ = new QComboBox(bar);
  between_ = new QLabel(bar);
  left_choice_->setObjectName(QStringLiteral("leftMethod"));
  left_choice_->setAccessibleName(tr("Method at the left, A"));
  right_choice_->setObjectName(QStringLiteral("rightMethod"));
  right_choice_->setAccessibleName(tr("Method at the right, B"));
  for (QComboBox* choice : {left_choice_, right_choice_}) {
    choice->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    choice->setMinimumContentsLength(10);
    connect(choice, &QComboBox::currentIndexChanged, this, [this] {
      draw();
      emit shownChanged();
    });
  }
  layout->addWidget(left_choice_, 1);
  layout->addWidget(between_);
  layout->addWidget(right_choice_, 1);
  return bar;
}

QWidget* FieldPanel::makeViews() {
  auto* views = new QWidget(this);
  auto* layout = new QHBoxLayout(views);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(1);
  left_ = new FieldView(views);
  right_ = new FieldView(views);
  left_->setObjectName(QStringLiteral("fieldLeft"));
  right_->setObjectName(QStringLiteral("fieldRight"));
  right_->linkCamera(left_);
  for (FieldView* view : {left_, right_}) {
    view->setLegendShown(false);
    layout->addWidget(view, 1);
    connect(view, &FieldView::nodeClicked, this, &FieldPanel::nodeClicked);
  }
  return views;
}

QWidget* FieldPanel::makeLegend() {
  auto* legend = new QWidget(this);
  legend->setObjectName(QStringLiteral("legendBar"));
  legend->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(legend);
  layout->setContentsMargins(0, 0, 12, 0);
  strip_ = new ScaleStrip(legend);
  strip_->setObjectName(QStringLiteral("scaleStrip"));
  colors_to_ = new QComboBox(legend);
  colors_to_->setObjectName(QStringLiteral("colorsTo"));
  colors_to_->setAccessibleName(tr("Upper end of the colours"));
  colors_to_->setToolTip(tr("Upper end of the colours, the same in every view"));
  colors_to_->addItem(tr("Automatic"), 0.0);
  for (const double end_mm : kColorEnds_mm) colors_to_->addItem(tr("to %1 mm").arg(end_mm), end_mm);
  connect(colors_to_, &QComboBox::currentIndexChanged, this, &FieldPanel::draw);
  certainty_text_ = new QLabel(legend);
  certainty_text_->setObjectName(QStringLiteral("certaintyText"));
  certainty_text_->setProperty("role", "muted");
  certainty_text_->setWordWrap(true);
  certainty_text_->setMaximumWidth(180);
  layout->addWidget(strip_, 1);
  layout->addWidget(certainty_text_);
  layout->addWidget(colors_to_);
  return legend;
}

void FieldPanel::setComparison(const CalibrationTable& table, const std::optional<Comparison>& comparison) {
  const auto method_of = [this](MethodRow row) {
    return row && comparison_ ? QString::fromStdString(comparison_->position.at(*row).method) : QString();
  };
  const QString left = method_of(this->left()), right = method_of(this->right());
  table_ = table;
  comparison_ = comparison;
  orientation_row_.reset();
  volume_bar_->setLattice(comparison ? latticeAround(table) : VolumeField{});
  fillChoosers();
  if (!comparison_) return;
  setLeft(positionRow(*comparison_, left));
  setRight(positionRow(*comparison_, right));
  draw();
}

void FieldPanel::fillChoosers() {
  for (QComboBox* choice : {left_choice_, right_choice_}) {
    const QSignalBlocker quiet(choice);
    choice->clear();
    choice->addItem(tr("Before correction"), kBefore);
    if (!comparison_) continue;
    for (std::size_t row = 0; row < comparison_->position.size(); ++row) {
      const MethodScore& score = comparison_->position[row];
      if (score.skipped || score.method == "none") continue;
      choice->addItem(QStringLiteral("%1:  %2 mm").arg(positionLabel(score), threeFigures(score.stats.rms)),
                      static_cast<int>(row));
    }
  }
}

void FieldPanel::setLeft(MethodRow row) { chooseRow(left_choice_, row); }
void FieldPanel::setRight(MethodRow row) { chooseRow(right_choice_, row); }
MethodRow FieldPanel::left() const { return rowOf(left_choice_); }
MethodRow FieldPanel::right() const { return rowOf(right_choice_); }
FieldPanel::Mode FieldPanel::mode() const { return static_cast<Mode>(modes_->checkedId()); }
void FieldPanel::setMode(Mode mode) { modes_->button(static_cast<int>(mode))->setChecked(true); }

void FieldPanel::setOrientation(MethodRow row) {
  orientation_row_ = row;
  draw();
}

void FieldPanel::setSelected(int node) {
  left_->setSelected(node);
  right_->setSelected(node);
}

void FieldPanel::setHoles(const std::vector<SceneCell>& holes) {
  left_->setHoles(holes);
  right_->setHoles(holes);
}

void FieldPanel::setFolds(const std::vector<SceneCell>& cells) {
  left_->setFolds(cells);
  right_->setFolds(cells);
}

ErrorField FieldPanel::fieldOf(MethodRow row) {
  ErrorField field = heldOutField(*comparison_, table_, row, row ? orientation_row_ : MethodRow());
  if (certainty_->isChecked()) addUncertainty(field, row);
  return field;
}

void FieldPanel::addUncertainty(ErrorField& field, MethodRow row) {
  if (!row) return;
  const auto corrector = fitted_.get(*row);
  if (!corrector) return;
  const std::vector<double> sds_mm = uncertaintyAtPlaces_mm(*corrector, *comparison_, table_);
  for (std::size_t i = 0; i < field.arrows.size(); ++i)
    if (std::isfinite(sds_mm[i])) field.arrows[i].uncertainty_mm = sds_mm[i];
}

void FieldPanel::draw() {
  if (!comparison_) return;
  const bool difference = mode() == Mode::kDifference;
  left_->setVisible(mode() == Mode::kSideBySide);
  left_choice_->setVisible(mode() != Mode::kOne);
  between_->setVisible(difference);
  between_->setText(tr("minus"));
  volume_bar_->setDifference(difference);
  ErrorField right =
      difference ? differenceField(*comparison_, table_, this->left(), this->right()) : fieldOf(this->right());
  std::vector<const ErrorField*> shown = {&right};
  ErrorField left;
  if (mode() == Mode::kSideBySide) {
    left = fieldOf(this->left());
    left_->setField(left);
    shown.push_back(&left);
  }
  right_->setField(right);
  drawVolume();
  showScale(shown);
  showCertainty(shown);
}

VolumeKey FieldPanel::keyOf(const FieldView* view) const {
  const VolumeQuantity quantity = volume_bar_->quantity();
  if (quantity != VolumeQuantity::kNone && mode() == Mode::kDifference)
    return {VolumeQuantity::kCorrection, left(), right(), true};
  return {quantity, view == left_ ? left() : right(), std::nullopt, false};
}

void FieldPanel::drawVolume() {
  QStringList texts;
  double largest_mm = 0.0;
  for (FieldView* view : {left_, right_}) {
    if (!view->isVisibleTo(this)) continue;
    const VolumeKey key = keyOf(view);
    const VolumeField* volume = volumes_.get(key);
    view->setVolume(volume ? *volume : VolumeField{});
    if (volume) largest_mm = std::max(largest_mm, volume->largest_mm().value_or(0.0));
    texts << volumes_.text(key);
  }
  texts.removeDuplicates();
  volume_bar_->setText(texts.join(QLatin1Char('\n')));
  if (largest_mm > 0.0) volume_bar_->suggestIso_mm(0.5 * largest_mm);
  drawSlice();
}

void FieldPanel::drawSlice() {
  for (FieldView* view : {left_, right_}) {
    view->setSlice(volume_bar_->slice());
    view->setIso(volume_bar_->iso_mm());
  }
}

std::vector<const VolumeField*> FieldPanel::volumesShown() {
  std::vector<const VolumeField*> volumes;
  for (const FieldView* view : {left_, right_})
    if (view->isVisibleTo(this))
      if (const VolumeField* volume = volumes_.get(keyOf(view))) volumes.push_back(volume);
  return volumes;
}

void FieldPanel::showScale(const std::vector<const ErrorField*>& fields) {
  const bool difference = mode() == Mode::kDifference;
  const FieldScale scale = sharedScale(fields, volumesShown());
  const double chosen_mm = colors_to_->currentData().toDouble();
  const double max_mm = chosen_mm > 0.0 ? chosen_mm : scale.max_mm;
  left_->setScaleMax_mm(max_mm);
  right_->setScaleMax_mm(max_mm);
  strip_->setScale(difference ? ScaleStrip::Scale::kDifference : ScaleStrip::Scale::kMagnitude, max_mm,
                   exceeds(fields, max_mm));
  strip_->setEnds(tr("A nearer the truth"), tr("B nearer the truth"));
  suited_magnification_ = scale.magnification;
  const QSignalBlocker quiet(arrows_);
  arrows_->setValue(sliderOf(suited_magnification_ * arrows_factor_));
  magnify(arrows_factor_ == 1.0 ? suited_magnification_ : magnificationOf(arrows_->value()));
}

void FieldPanel::showCertainty(const std::vector<const ErrorField*>& fields) {
  const bool wanted = certainty_->isChecked() && mode() != Mode::kDifference;
  const std::optional<OpacityRange> range = wanted ? opacityRange(fields) : std::nullopt;
  left_->setOpacityRange(range);
  right_->setOpacityRange(range);
  strip_->setOpacityRange(range);
  QString text;
  if (certainty_->isChecked() && mode() == Mode::kDifference)
    text = tr("Certainty belongs to one method, not to a difference.");
  if (wanted && !range) {
    const MethodRow row = right() ? right() : left();
    const QString why = row ? fitted_.why(*row) : QString();
    text = fitted_.busy()   ? tr("Fitting...")
           : !why.isEmpty() ? why
                            : tr("%1 does not state its uncertainty.").arg(positionLabel(*comparison_, row));
  }
  certainty_text_->setText(text);
  certainty_text_->setVisible(!text.isEmpty());
}

void FieldPanel::magnify(double magnification) {
  arrows_text_->setText(tr("\u00d7%1").arg(threeFigures(magnification)));
  left_->setMagnification(magnification);
  right_->setMagnification(magnification);
  strip_->setMagnification(magnification);
}

}  // namespace fieldtrue
