#include "widgets/compare/field_panel.h"

#include <QApplication>
#include <QComboBox>
#include <QFrame>
#include <QHBoxLayout>
#include <QLabel>
#include <QStyle>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

#include "calib/core/statistics.h"
#include "widgets/compare/field_scales.h"
#include "widgets/compare/view_bar.h"
#include "widgets/compare/volume_bar.h"
#include "widgets/compare/volume_store.h"
#include "widgets/figures/field_scale.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/field/field_view.h"
#include "widgets/workbench/fitted_methods.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kBefore = -1;
constexpr double kColorEnds_mm[] = {0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200};

MethodRow rowOf(const QComboBox* choice) {
  const QVariant data = choice->currentData();
  if (!data.isValid() || data.toInt() == kBefore) return std::nullopt;
  return static_cast<std::size_t>(data.toInt());
}

/// A frame that tells where the keys go.
QFrame* framed(QWidget* view) {
  auto* frame = new QFrame;
  frame->setObjectName(QStringLiteral("viewFrame"));
  auto* layout = new QVBoxLayout(frame);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->addWidget(view);
  QObject::connect(qApp, &QApplication::focusChanged, frame,
                   [frame, view](QWidget*, QWidget* now) { setStyled(*frame, "focused", now == view); });
  return frame;
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
  view_bar_ = new ViewBar(this);
  layout->addWidget(view_bar_);
  layout->addWidget(makeChoosers());
  layout->addWidget(makeViews(), 1);
  layout->addWidget(makeLegend());
  volume_bar_ = new VolumeBar(this);
  layout->addWidget(volume_bar_);
  connectBars();
}

void FieldPanel::connectBars() {
  connect(view_bar_, &ViewBar::modeChanged, this, [this] {
    draw();
    emit shownChanged();
  });
  connect(view_bar_, &ViewBar::certaintyChanged, this, &FieldPanel::draw);
  connect(view_bar_, &ViewBar::cameraChosen, right_, &FieldView::setCamera);
  connect(view_bar_, &ViewBar::turnsShown, this, [this](bool on) {
    left_->setShowOrientation(on);
    right_->setShowOrientation(on);
  });
  connect(view_bar_, &ViewBar::magnified, this, [this](double magnification) {
    left_->setMagnification(magnification);
    right_->setMagnification(magnification);
    strip_->setMagnification(magnification);
  });
  connect(volume_bar_, &VolumeBar::quantityChanged, this, &FieldPanel::draw);
  connect(volume_bar_, &VolumeBar::sliceChanged, this, &FieldPanel::drawSlice);
  connect(volume_bar_, &VolumeBar::isoChanged, this, &FieldPanel::drawSlice);
  connect(&volumes_, &VolumeStore::changed, this, &FieldPanel::draw);
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
  left_ = new FieldView(this);
  right_ = new FieldView(this);
  left_->setObjectName(QStringLiteral("fieldLeft"));
  right_->setObjectName(QStringLiteral("fieldRight"));
  right_->linkCamera(left_);
  for (FieldView* view : {left_, right_}) {
    view->setLegendShown(false);
    layout->addWidget(framed(view), 1);
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

void FieldPanel::setComparison(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison) {
  const auto method_of = [this](MethodRow row) {
    return row && comparison_ ? QString::fromStdString(comparison_->position.at(*row).method) : QString();
  };
  const QString left = method_of(this->left()), right = method_of(this->right());
  table_ = table;
  comparison_ = comparison;
  orientation_row_.reset();
  volume_bar_->setLattice(comparison ? latticeAround(table) : VolumeField{});
  volume_bar_->setWaysHeld(waysHeld(table));
  fillChoosers();
  if (!comparison_) {
    // What another session left must not pass for this one's.
    for (FieldView* view : {left_, right_}) {
      view->setField({});
      view->setVolume({});
    }
    return;
  }
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
      const evaluation::MethodScore& score = comparison_->position[row];
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
  if (view_bar_->certaintyShown()) addUncertainty(field, row);
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
  const bool difference = view_bar_->mode() == ViewBar::Mode::kDifference;
  left_->parentWidget()->setVisible(view_bar_->mode() == ViewBar::Mode::kSideBySide);
  left_choice_->setVisible(view_bar_->mode() != ViewBar::Mode::kOne);
  between_->setVisible(difference);
  between_->setText(tr("minus"));
  volume_bar_->setDifference(difference);
  ErrorField right =
      difference ? differenceField(*comparison_, table_, this->left(), this->right()) : fieldOf(this->right());
  std::vector<const ErrorField*> shown = {&right};
  ErrorField left;
  if (view_bar_->mode() == ViewBar::Mode::kSideBySide) {
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
  if (quantity != VolumeQuantity::kNone && view_bar_->mode() == ViewBar::Mode::kDifference)
    return {VolumeQuantity::kCorrection, left(), right(), true, volume_bar_->held()};
  const int held = quantity == VolumeQuantity::kExpectedError ? kMeanHeld : volume_bar_->held();
  return {quantity, view == left_ ? left() : right(), std::nullopt, false, held};
}

void FieldPanel::drawVolume() {
  QStringList texts;
  double largest_mm = 0.0;
  for (FieldView* view : {left_, right_}) {
    if (!view->parentWidget()->isVisibleTo(this)) continue;
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
    if (view->parentWidget()->isVisibleTo(this))
      if (const VolumeField* volume = volumes_.get(keyOf(view))) volumes.push_back(volume);
  return volumes;
}

void FieldPanel::showScale(const std::vector<const ErrorField*>& fields) {
  const bool difference = view_bar_->mode() == ViewBar::Mode::kDifference;
  const FieldScale scale = sharedScale(fields, volumesShown());
  const double chosen_mm = colors_to_->currentData().toDouble();
  const double max_mm = chosen_mm > 0.0 ? chosen_mm : scale.max_mm;
  left_->setScaleMax_mm(max_mm);
  right_->setScaleMax_mm(max_mm);
  strip_->setScale(difference ? ScaleStrip::Scale::kDifference : ScaleStrip::Scale::kMagnitude, max_mm,
                   exceeds(fields, max_mm));
  strip_->setEnds(tr("A nearer the truth"), tr("B nearer the truth"));
  const VolumeQuantity quantity = volume_bar_->quantity();
  strip_->setMeaning(quantity == VolumeQuantity::kCorrection    ? tr("error, correction")
                     : quantity == VolumeQuantity::kUncertainty ? tr("error, SD")
                                                                : tr("error"));
  strip_->setVolumeMeaning(difference && quantity != VolumeQuantity::kNone ? tr("distance") : QString());
  view_bar_->suitMagnification(scale.magnification);
}

void FieldPanel::showCertainty(const std::vector<const ErrorField*>& fields) {
  const bool wanted = view_bar_->certaintyShown() && view_bar_->mode() != ViewBar::Mode::kDifference;
  const std::optional<OpacityRange> range = wanted ? opacityRange(fields) : std::nullopt;
  left_->setOpacityRange(range);
  right_->setOpacityRange(range);
  strip_->setOpacityRange(range);
  QString text;
  if (view_bar_->certaintyShown() && view_bar_->mode() == ViewBar::Mode::kDifference)
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

}  // namespace fieldtrue::widgets
