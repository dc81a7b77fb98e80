#include "widgets/pages/compare_page.h"

#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QSplitter>
#include <QStackedWidget>
#include <QStyle>
#include <QTabWidget>
#include <QVBoxLayout>

#include "calib/calibration/alignment.h"
#include "widgets/compare/curve_panel.h"
#include "widgets/compare/field_panel.h"
#include "widgets/compare/method_panel.h"
#include "widgets/compare/place_panel.h"
#include "widgets/compare/verdict_panel.h"
#include "widgets/compare/volume_store.h"
#include "widgets/forms/empty_page.h"
#include "widgets/forms/sensor_choice.h"
#include "widgets/report/report_data.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/field/volume_field.h"
#include "widgets/workbench/fitted_methods.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kCompareInspectorWidth = 432;
constexpr int kNarrowestInspector = 320;
constexpr std::size_t kFewestPlaces = 5;

}  // namespace

ComparePage::ComparePage(Workbench& workbench, QWidget* parent)
    : QWidget(parent),
      workbench_(workbench),
      fitted_methods_(new FittedMethods(this)),
      volumes_(new VolumeStore(*fitted_methods_, this)) {
  auto* content = new QWidget(this);
  auto* rows = new QVBoxLayout(content);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->setSpacing(0);
  rows->addWidget(makeHeader());
  fields_ = new FieldPanel(*fitted_methods_, *volumes_, content);
  auto* splitter = new QSplitter(content);
  splitter->addWidget(fields_);
  splitter->addWidget(makeInspector());
  splitter->setStretchFactor(0, 1);
  splitter->setSizes({880, kCompareInspectorWidth});
  splitter->setCollapsible(0, false);
  rows->addWidget(splitter, 1);

  stack_ = new QStackedWidget(this);
  stack_->addWidget(new EmptyPage(
      tr("Nothing to compare yet."),
      tr("At least %1 places must be taken; then every method is tried on places it did not see.").arg(kFewestPlaces),
      {{tr("Acquire"), [this] { workbench_.goToPage(QStringLiteral("acquire")); }},
       {tr("Run the demonstration"), [this] { workbench_.startDemonstration(); }}},
      this));
  stack_->addWidget(content);
  stack_->addWidget(makeOpeningPage(this));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(stack_);
  connectParts();
  onTable();
}

void ComparePage::connectParts() {
  connect(&workbench_, &Workbench::sessionChanged, this, &ComparePage::onTable);
  connect(&workbench_, &Workbench::tableChanged, this, &ComparePage::onTable);
  connect(&workbench_, &Workbench::comparisonChanged, this, &ComparePage::onComparison);
  connect(&workbench_, &Workbench::correctorChanged, this, &ComparePage::showChoice);
  connect(&workbench_, &Workbench::fittingChanged, this, &ComparePage::showChoice);
  connect(&workbench_, &Workbench::comparisonProgress, this, &ComparePage::onProgress);
  connect(&workbench_, &Workbench::closing, this, [this] {
    fitted_methods_->stop();
    volumes_->reset({}, std::nullopt);
    curve_->stop();
  });
  connect(fields_, &FieldPanel::nodeClicked, this, &ComparePage::selectNode);
  connect(fields_, &FieldPanel::shownChanged, this, &ComparePage::onShown);
  connect(place_, &PlacePanel::nodeChosen, this, &ComparePage::selectNode);
  connect(verdict_panel_, &VerdictPanel::marksChanged, this, &ComparePage::showMarks);
  for (MethodPanel* panel : {position_, rotation_}) {
    connect(panel, &MethodPanel::methodChanged, this, &ComparePage::showChoice);
    connect(panel, &MethodPanel::ticksChanged, this, &ComparePage::showChoice);
  }
}

QWidget* ComparePage::makeHeader() {
  header_ = new QWidget(this);
  header_->setObjectName(QStringLiteral("verdictBar"));
  header_->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(header_);
  layout->setContentsMargins(20, 8, 20, 8);
  layout->setSpacing(20);
  auto* texts = new QVBoxLayout;
  texts->setSpacing(2);
  headline_ = new QLabel(header_);
  headline_->setObjectName(QStringLiteral("headline"));
  headline_->setProperty("role", "headline");
  headline_->setWordWrap(true);
  verdict_ = new QLabel(header_);
  verdict_->setObjectName(QStringLiteral("verdict"));
  verdict_->setWordWrap(true);
  verdict_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  texts->addWidget(headline_);
  texts->addWidget(verdict_);
  layout->addLayout(texts, 1);
  layout->addWidget(makeControls(header_), 0, Qt::AlignTop);
  return header_;
}

QWidget* ComparePage::makeControls(QWidget* header) {
  auto* controls = new QWidget(header);
  auto* layout = new QVBoxLayout(controls);
  layout->setContentsMargins(0, 4, 0, 0);
  validation_ = new QComboBox(controls);
  validation_->setObjectName(QStringLiteral("validation"));
  validation_->addItem(tr("As suits the table"), QString());
  validation_->addItem(tr("10 folds"), QStringLiteral("kfold:10"));
  validation_->addItem(tr("Leave one place out"), QStringLiteral("loo"));
  validation_->addItem(tr("8 blocks of space"), QStringLiteral("block:8"));
  validation_->addItem(tr("Validation places"), QStringLiteral("role"));
  validation_->setAccessibleName(tr("How methods are judged"));
  connect(validation_, &QComboBox::activated, this, [this] { runComparison(true); });
  run_ = new QPushButton(tr("Compare"), controls);
  run_->setObjectName(QStringLiteral("runComparison"));
  run_->setProperty("primary", true);
  connect(run_, &QPushButton::clicked, this, [this] {
    if (workbench_.isComparing()) {
      slow_to_come_ = false;
      stopped_ = true;
      workbench_.stopComparing();
    } else {
      runComparison(false);
    }
  });
  progress_ = new QProgressBar(controls);
  progress_->setRange(0, 1000);
  progress_->setAccessibleName(tr("Comparison"));
  progress_text_ = new QLabel(controls);
  progress_text_->setProperty("role", "muted");
  progress_text_->setWordWrap(true);
  auto* row = new QHBoxLayout;
  row->addWidget(new SensorChoice(workbench_, QStringLiteral("compareSensor"), controls));
  row->addWidget(validation_);
  row->addWidget(run_);
  layout->addLayout(row);
  layout->addWidget(progress_);
  layout->addWidget(progress_text_);
  return controls;
}

QWidget* ComparePage::makeInspector() {
  auto* inspector = new QWidget(this);
  inspector->setObjectName(QStringLiteral("inspector"));
  inspector->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QVBoxLayout(inspector);
  layout->setContentsMargins(12, 8, 12, 12);
  tabs_ = new QTabWidget(inspector);
  tabs_->setObjectName(QStringLiteral("inspectorTabs"));
  verdict_panel_ = new VerdictPanel(tabs_);
  position_ = new MethodPanel(MethodPart::kPosition, QStringLiteral("position"), tabs_);
  rotation_ = new MethodPanel(MethodPart::kOrientation, QStringLiteral("orientation"), tabs_);
  place_ = new PlacePanel(tabs_);
  curve_ = new CurvePanel(tabs_);
  position_->setObjectName(QStringLiteral("positionPanel"));
  rotation_->setObjectName(QStringLiteral("orientationPanel"));
  curve_->setObjectName(QStringLiteral("curvePanel"));
  tabs_->addTab(verdict_panel_, tr("Verdict"));
  tabs_->addTab(position_, tr("Position"));
  tabs_->addTab(rotation_, tr("Orientation"));
  tabs_->addTab(place_, tr("Place"));
  tabs_->addTab(curve_, tr("Curve"));
  tabs_->tabBar()->setExpanding(false);
  tabs_->setUsesScrollButtons(false);
  layout->addWidget(tabs_, 1);
  fit_ = new QPushButton(tr("Fit these methods"), inspector);
  fit_->setObjectName(QStringLiteral("fit"));
  fit_->setProperty("primary", true);
  connect(fit_, &QPushButton::clicked, this, &ComparePage::fitChosen);
  fitted_ = new QLabel(inspector);
  fitted_->setObjectName(QStringLiteral("fitted"));
  fitted_->setProperty("role", "muted");
  fitted_->setWordWrap(true);
  layout->addWidget(fit_);
  layout->addWidget(fitted_);
  // A place and a curve need the height, and nothing is chosen there.
  connect(tabs_, &QTabWidget::currentChanged, this, [this](int tab) {
    for (QWidget* widget : {static_cast<QWidget*>(fit_), static_cast<QWidget*>(fitted_)})
      widget->setVisible(tab < tabs_->indexOf(place_));
  });
  inspector->setMinimumWidth(kNarrowestInspector);
  return inspector;
}

void ComparePage::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  if (out_of_date_ && stack_->currentIndex() == 1) runComparison(true);
}

void ComparePage::onTable() {
  std::size_t usable = 0;
  for (const Node& node : workbench_.table().nodes) usable += node.role != NodeRole::kSkipped;
  stack_->setCurrentIndex(usable >= kFewestPlaces ? 1 : workbench_.isOpening() ? 2 : 0);
  out_of_date_ = true;
  showPlaceData();
  if (stack_->currentIndex() == 1 && isVisible()) runComparison(true);
}

void ComparePage::showPlaceData() {
  place_->setData(
      workbench_.table(), [this](int node) { return workbench_.samplesAt(node); }, workbench_.comparison());
}

void ComparePage::runComparison(bool quick_first) {
  out_of_date_ = false;
  evaluation::ComparisonOptions options;
  const auto validation = evaluation::parseValidation(validation_->currentData().toString().toStdString());
  if (validation) options.validation = *validation;
  options.position_methods = quick_first ? position_->tickedQuick() : position_->ticked();
  options.orientation_methods = quick_first ? rotation_->tickedQuick() : rotation_->ticked();
  n_compared_ = static_cast<int>(options.position_methods.size() + options.orientation_methods.size());
  const int n_ticked = position_->tickedCount() + rotation_->tickedCount();
  slow_to_come_ = n_compared_ < n_ticked;
  stopped_ = false;
  // An empty list would mean all methods; none ticked means the error before alone.
  for (auto* methods : {&options.position_methods, &options.orientation_methods})
    methods->insert(methods->begin(), MethodText{"none", {}});
  workbench_.compare(options, {n_compared_, n_ticked});
}

void ComparePage::onProgress(double fraction) {
  progress_->setValue(static_cast<int>(fraction * 1000.0));
  const QString done = QString::number(static_cast<int>(100.0 * fraction));
  progress_text_->setText(workbench_.comparison() && n_compared_ > 0
                              ? tr("%1 % of %2 methods; figures of the last run").arg(done).arg(n_compared_)
                              : tr("%1 % of %2 methods").arg(done).arg(n_compared_));
}

void ComparePage::onComparison() {
  const bool running = workbench_.isComparing();
  progress_->setVisible(running);
  progress_text_->setVisible(running);
  run_->setText(running ? tr("Stop") : tr("Compare again"));
  setStyled(*run_, "primary", !workbench_.comparison());
  if (running) {
    onProgress(0.0);
    showHeadline();
    showChoice();
    return;
  }
  showComparison();
  if (slow_to_come_ && workbench_.comparison()) runComparison(false);
}

void ComparePage::showComparison() {
  const std::optional<evaluation::Comparison>& comparison = workbench_.comparison();
  // A view that shows the best goes on showing the best, whichever that is now.
  const bool follows_best = fields_->right() == shown_best_;
  fitted_methods_->reset(workbench_.table(), comparison);
  volumes_->reset(workbench_.table(), comparison);
  position_->setComparison(comparison);
  rotation_->setComparison(comparison);
  verdict_panel_->setComparison(comparison);
  curve_->setComparison(workbench_.table(), comparison);
  showPlaceData();
  fields_->setComparison(workbench_.table(), comparison);
  showHeadline();
  if (!comparison) return showChoice();
  position_->choose(QString::fromStdString(comparison->best_position));
  rotation_->choose(QString::fromStdString(comparison->best_orientation));
  fields_->setOrientation(comparison->best_orientation_row);
  shown_best_ = comparison->best_position_row;
  if (follows_best || !fields_->right()) fields_->setRight(shown_best_);
  onShown();
  showMarks();
}

void ComparePage::showHeadline() {
  const std::optional<evaluation::Comparison>& comparison = workbench_.comparison();
  const bool running = workbench_.isComparing();
  QString state, headline, words;
  if (!comparison) {
    headline = running    ? tr("Comparing...")
               : stopped_ ? tr("Stopped; nothing is compared yet")
                          : tr("Not compared yet");
    words = running ? tr("Trying every ticked method on places it has not seen.") : workbench_.refusal();
  } else {
    const auto best = comparison->best_position_row;
    const QString before = threeFigures(comparison->before_position_mm.rms);
    const QString gain = best ? tr("%1 \u2192 %2 mm").arg(before, threeFigures(comparison->position[*best].stats.rms))
                              : tr("%1 mm").arg(before);
    words = QString::fromStdString(comparison->verdict.text);
    const Workbench::MethodCount count = workbench_.comparedMethods();
    if (workbench_.comparisonIsFinal() && !stopped_) {
      const QString caution = QString::fromStdString(cautionText(*comparison));
      if (const std::string untried = notComparedText(*comparison); !untried.empty())
        words += tr(" Not compared: %1.").arg(QString::fromStdString(untried));
      const bool apply = comparison->verdict.apply_position;
      state = !apply ? QStringLiteral("leave") : caution.isEmpty() ? QStringLiteral("apply") : QStringLiteral("care");
      const bool inside_out = comparison->verdict.is_inside_out;
      headline = inside_out          ? tr("Do not correct: axes or places of the readings are wrong")
                 : !apply            ? tr("Do not correct: %1 mm as it is").arg(before)
                 : caution.isEmpty() ? tr("Apply it: %1").arg(gain)
                                     : tr("Apply with care, %1: %2").arg(caution, gain);
    } else if (!workbench_.comparisonIsCurrent()) {
      headline =
          running ? tr("Comparing again; before that %1").arg(gain) : tr("The places have changed since: %1").arg(gain);
      words = running ? tr("The figures are those of the last comparison, of other rows.")
                      : tr("The figures are those of the last comparison, of other rows; compare again.");
    } else if (count.done < count.wanted) {
      headline =
          (running || slow_to_come_ ? tr("So far, %1 of %2 methods: %3") : tr("Stopped after %1 of %2 methods: %3"))
              .arg(count.done)
              .arg(count.wanted)
              .arg(gain);
      words = tr("Not the last word, for the other methods are not tried yet. So far: %1").arg(words);
    } else {
      headline = (running ? tr("Comparing again; before that %1") : tr("Stopped; before that %1")).arg(gain);
      words = tr("The figures are those of the last comparison. It said: %1").arg(words);
    }
  }
  headline_->setText(headline);
  verdict_->setText(words);
  header_->setProperty("state", state);
  for (QWidget* widget : {header_, static_cast<QWidget*>(headline_)}) restyle(*widget);
}

QString ComparePage::whyNotFit() const {
  if (workbench_.isComparing())
    return tr("Wait for the comparison, or stop it: until then no method is chosen for good.");
  if (!workbench_.comparisonIsCurrent())
    return tr("Compare first: a fit takes methods that were tried on these places.");
  for (const MethodPanel* panel : {position_, rotation_})
    if (const QString why = panel->whyUnusable(); !why.isEmpty()) return why;
  if (position_->method() == QLatin1String("none") && rotation_->method() == QLatin1String("none"))
    return tr("No correction is chosen, for position and for orientation: there is nothing to fit.");
  return {};
}

void ComparePage::showChoice() {
  const QString why = whyNotFit();
  const QString choice = tr("%1 for position, %2 for orientation.").arg(position_->label(), rotation_->label());
  fit_->setText(workbench_.isFitting() ? tr("Fitting...") : tr("Fit these methods"));
  // While it fits too: the focus of a button that is off goes to the steps, and the next key with it.
  fit_->setEnabled(why.isEmpty());
  fit_->setToolTip(why.isEmpty() ? choice : why);
  const std::optional<calibration::Corrector>& corrector = workbench_.corrector();
  if (!why.isEmpty()) return fitted_->setText(why);
  if (!corrector) return fitted_->setText(choice);
  if (!workbench_.correctorIsCurrent())
    return fitted_->setText(tr("%1 The places have changed since the calibration was fitted: fit again.").arg(choice));
  const std::optional<bool> is_kept = workbench_.correctorIsKept();
  const QString kept = !is_kept   ? QString()
                       : *is_kept ? tr(" Kept in the session, ready to export.")
                                  : tr(" Not kept in the session: export it now.");
  fitted_->setText(tr("Fitted on %1 rows; what is left on those same rows (no verdict): RMS %2.")
                       .arg(corrector->report().n_nodes)
                       .arg(millimetreText(corrector->report().rms_m)) +
                   kept);
}

void ComparePage::onShown() {
  verdict_panel_->showMethods(fields_->left(), fields_->right());
  curve_->showMethods(fields_->left(), fields_->right());
}

void ComparePage::showMarks() {
  fields_->setHoles(verdict_panel_->holes());
  fields_->setFolds(verdict_panel_->folds());
}

void ComparePage::fitChosen() {
  calibration::CorrectorChoice choice;
  choice.position_id = position_->method().toStdString();
  choice.position_settings = position_->settings();
  choice.orientation_id = rotation_->method().toStdString();
  choice.orientation_settings = rotation_->settings();
  workbench_.fit(choice, calibration::defaultAlignMode(workbench_.table().metadata));
}

void ComparePage::selectNode(int node) {
  fields_->setSelected(node);
  place_->setNode(node);
  tabs_->setCurrentWidget(place_);
}

}  // namespace fieldtrue::widgets
