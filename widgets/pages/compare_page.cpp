#include "widgets/pages/compare_page.h"

#include <QCheckBox>
#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QSlider>
#include <QSplitter>
#include <QStackedWidget>
#include <QTabWidget>
#include <QVBoxLayout>
#include <cmath>

#include "widgets/pages/empty_page.h"
#include "widgets/pages/error_fields.h"
#include "widgets/pages/method_panel.h"
#include "widgets/pages/units.h"
#include "widgets/views/chart_views.h"
#include "widgets/views/field_scale.h"
#include "widgets/views/field_view.h"

namespace fieldtrue {
namespace {

constexpr int kInspectorWidth = 440;
constexpr std::size_t kFewestPlaces = 5;

// The slider runs over magnifications 1 to 100 in even ratios.
double magnificationOf(int slider) { return std::pow(10.0, slider / 50.0); }
int sliderOf(double magnification) { return static_cast<int>(std::lround(50.0 * std::log10(magnification))); }

}  // namespace

ComparePage::ComparePage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  auto* content = new QWidget(this);
  auto* rows = new QVBoxLayout(content);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->setSpacing(0);
  rows->addWidget(makeHeader());
  auto* splitter = new QSplitter(content);
  splitter->addWidget(makeViews());
  splitter->addWidget(makeInspector());
  splitter->setStretchFactor(0, 1);
  splitter->setSizes({880, kInspectorWidth});
  rows->addWidget(splitter, 1);

  stack_ = new QStackedWidget(this);
  stack_->addWidget(new EmptyPage(
      tr("Nothing to compare yet."),
      tr("At least %1 places must be taken; then every method is tried on places it did not see.").arg(kFewestPlaces),
      {{tr("Acquire"), [this] { workbench_.goToStep(Step::kAcquire); }},
       {tr("Run the demonstration"), [this] { workbench_.startDemonstration(); }}},
      this));
  stack_->addWidget(content);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(stack_);

  connect(&workbench_, &Workbench::tableChanged, this, &ComparePage::onTable);
  connect(&workbench_, &Workbench::comparisonChanged, this, &ComparePage::onComparison);
  connect(&workbench_, &Workbench::correctorChanged, this, &ComparePage::onCorrector);
  connect(&workbench_, &Workbench::comparisonProgress, this,
          [this](double fraction) { progress_->setValue(static_cast<int>(fraction * 1000.0)); });
  onTable();
}

QWidget* ComparePage::makeHeader() {
  auto* header = new QWidget(this);
  header->setObjectName(QStringLiteral("verdictBar"));
  header->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(header);
  layout->setContentsMargins(20, 12, 20, 12);
  auto* texts = new QVBoxLayout;
  verdict_ = new QLabel(header);
  verdict_->setObjectName(QStringLiteral("verdict"));
  verdict_->setProperty("role", "title");
  verdict_->setWordWrap(true);
  details_ = new QLabel(header);
  details_->setProperty("role", "muted");
  details_->setWordWrap(true);
  texts->addWidget(verdict_);
  texts->addWidget(details_);
  layout->addLayout(texts, 1);
  progress_ = new QProgressBar(header);
  progress_->setRange(0, 1000);
  progress_->setFixedWidth(140);
  progress_->setAccessibleName(tr("Comparison"));
  validation_ = new QComboBox(header);
  validation_->addItem(tr("Leave one place out"), QStringLiteral("loo"));
  validation_->addItem(tr("10 folds"), QStringLiteral("kfold:10"));
  validation_->addItem(tr("8 blocks of space"), QStringLiteral("block:8"));
  validation_->addItem(tr("Validation places"), QStringLiteral("role"));
  validation_->setAccessibleName(tr("How methods are judged"));
  connect(validation_, &QComboBox::activated, this, &ComparePage::runComparison);
  run_ = new QPushButton(tr("Compare"), header);
  run_->setObjectName(QStringLiteral("runComparison"));
  run_->setProperty("primary", true);
  connect(run_, &QPushButton::clicked, this, [this] {
    if (workbench_.isComparing()) {
      workbench_.stopComparing();
    } else {
      runComparison();
    }
  });
  layout->addWidget(progress_);
  layout->addWidget(validation_);
  layout->addWidget(run_);
  return header;
}

QWidget* ComparePage::makeViews() {
  auto* panel = new QWidget(this);
  auto* layout = new QVBoxLayout(panel);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(0);
  auto* vertical = new QSplitter(Qt::Vertical, panel);
  auto* fields = new QSplitter(vertical);
  before_ = new FieldView(fields);
  after_ = new FieldView(fields);
  before_->setObjectName(QStringLiteral("fieldBefore"));
  after_->setObjectName(QStringLiteral("fieldAfter"));
  after_->linkCamera(before_);
  fields->addWidget(before_);
  fields->addWidget(after_);
  histogram_ = new HistogramView(vertical);
  histogram_->setObjectName(QStringLiteral("histogram"));
  vertical->addWidget(fields);
  vertical->addWidget(histogram_);
  vertical->setStretchFactor(0, 3);
  vertical->setStretchFactor(1, 1);
  vertical->setSizes({460, 170});
  layout->addWidget(makeViewBar());
  layout->addWidget(vertical, 1);
  for (FieldView* view : {before_, after_}) {
    connect(view, &FieldView::nodeHovered, this, [this](int, const QString& text) { hovered_->setText(text); });
    connect(view, &FieldView::nodeClicked, this, &ComparePage::selectNode);
  }
  return panel;
}

QWidget* ComparePage::makeViewBar() {
  auto* bar = new QWidget(this);
  bar->setObjectName(QStringLiteral("viewBar"));
  bar->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(bar);
  layout->setContentsMargins(12, 4, 12, 4);
  auto* scale_label = new QLabel(tr("Arrows"), bar);
  scale_ = new QSlider(Qt::Horizontal, bar);
  scale_->setObjectName(QStringLiteral("glyphScale"));
  scale_->setRange(0, 100);
  scale_->setFixedWidth(140);
  scale_->setAccessibleName(tr("Magnification of the arrows"));
  scale_text_ = new QLabel(bar);
  scale_text_->setMinimumWidth(48);
  connect(scale_, &QSlider::valueChanged, this, [this](int value) {
    scale_chosen_by_hand_ = true;
    magnify(magnificationOf(value));
  });
  two_views_ = new QCheckBox(tr("Before and after"), bar);
  two_views_->setChecked(true);
  connect(two_views_, &QCheckBox::toggled, this, [this](bool on) { before_->setVisible(on); });
  orientation_ = new QCheckBox(tr("Orientation error"), bar);
  connect(orientation_, &QCheckBox::toggled, this, [this](bool on) {
    before_->setShowOrientation(on);
    after_->setShowOrientation(on);
  });
  layout->addWidget(scale_label);
  layout->addWidget(scale_);
  layout->addWidget(scale_text_);
  layout->addWidget(two_views_);
  layout->addWidget(orientation_);
  auto* camera = new QComboBox(bar);
  camera->setAccessibleName(tr("Where to look from"));
  for (const auto& [label, preset] :
       {std::pair(tr("Operator"), CameraPreset::kOperator), std::pair(tr("Front"), CameraPreset::kFront),
        std::pair(tr("Side"), CameraPreset::kSide), std::pair(tr("Top"), CameraPreset::kTop)})
    camera->addItem(label, static_cast<int>(preset));
  connect(camera, &QComboBox::activated, this,
          [this, camera] { before_->setCamera(static_cast<CameraPreset>(camera->currentData().toInt())); });
  layout->addWidget(camera);
  hovered_ = new QLabel(bar);
  hovered_->setProperty("role", "muted");
  hovered_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  layout->addWidget(hovered_, 1);
  return bar;
}

QWidget* ComparePage::makeInspector() {
  auto* inspector = new QWidget(this);
  inspector->setObjectName(QStringLiteral("inspector"));
  inspector->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QVBoxLayout(inspector);
  layout->setContentsMargins(12, 12, 12, 12);
  position_ = new MethodPanel(ScoreModel::Part::kPosition, QStringLiteral("position"), inspector);
  rotation_ = new MethodPanel(ScoreModel::Part::kOrientation, QStringLiteral("orientation"), inspector);
  auto* tabs = new QTabWidget(inspector);
  tabs->addTab(position_, tr("Position"));
  tabs->addTab(rotation_, tr("Orientation"));
  layout->addWidget(tabs, 1);
  for (MethodPanel* panel : {position_, rotation_})
    connect(panel, &MethodPanel::methodChanged, this, &ComparePage::drawFields);
  fit_ = new QPushButton(tr("Fit these methods"), inspector);
  fit_->setObjectName(QStringLiteral("fit"));
  fit_->setProperty("primary", true);
  connect(fit_, &QPushButton::clicked, this, &ComparePage::fitChosen);
  fitted_ = new QLabel(inspector);
  fitted_->setObjectName(QStringLiteral("fitted"));
  fitted_->setWordWrap(true);
  layout->addWidget(fit_);
  layout->addWidget(fitted_);
  inspector->setMinimumWidth(kInspectorWidth);
  return inspector;
}

void ComparePage::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  if (out_of_date_ && stack_->currentIndex() == 1) runComparison();
}

void ComparePage::onTable() {
  std::size_t usable = 0;
  for (const Node& node : workbench_.table().nodes) usable += node.role != NodeRole::kSkipped;
  stack_->setCurrentIndex(usable >= kFewestPlaces ? 1 : 0);
  out_of_date_ = true;
  if (stack_->currentIndex() == 1 && isVisible()) runComparison();
}

void ComparePage::runComparison() {
  out_of_date_ = false;
  ComparisonOptions options;
  const auto validation = parseValidation(validation_->currentData().toString().toStdString());
  if (validation) options.validation = *validation;
  workbench_.compare(options);
}

void ComparePage::onComparison() {
  const bool running = workbench_.isComparing();
  progress_->setVisible(running);
  run_->setText(running ? tr("Stop") : tr("Compare again"));
  const std::optional<Comparison>& comparison = workbench_.comparison();
  if (running && !comparison) {
    verdict_->setText(tr("Trying every method on places it has not seen..."));
    details_->clear();
  }
  if (running) return;
  position_->setComparison(comparison);
  rotation_->setComparison(comparison);
  if (!comparison) {
    verdict_->setText(tr("Not compared yet."));
    details_->clear();
    return;
  }
  verdict_->setText(QString::fromStdString(comparison->verdict.text));
  QString details =
      tr("%1 places scored. What a perfect correction would leave, from the samples' scatter and the jig: %2 mm.")
          .arg(comparison->places.size())
          .arg(threeFigures(comparison->floor_position_mm));
  for (const std::string& note : comparison->notes) details += QStringLiteral(" ") + QString::fromStdString(note);
  details_->setText(details);
  chooseScale(*comparison);
  position_->choose(QString::fromStdString(comparison->best_position));
  rotation_->choose(QString::fromStdString(comparison->best_orientation));
  drawFields();
}

void ComparePage::chooseScale(const Comparison& comparison) {
  const FieldScale scale = fieldScale(heldOutField(comparison, workbench_.table(), QString(), QString(), QString()));
  before_->setScaleMax_mm(scale.max_mm);
  after_->setScaleMax_mm(scale.max_mm);
  if (scale_chosen_by_hand_) return;
  const QSignalBlocker quiet(scale_);
  scale_->setValue(sliderOf(scale.magnification));
  magnify(scale.magnification);
}

void ComparePage::magnify(double magnification) {
  scale_text_->setText(tr("x%1").arg(threeFigures(magnification)));
  before_->setMagnification(magnification);
  after_->setMagnification(magnification);
}

void ComparePage::drawFields() {
  const std::optional<Comparison>& comparison = workbench_.comparison();
  if (!comparison) return;
  const QString method = position_->method();
  const QString turned = rotation_->method();
  const QString label = position_->label();
  before_->setField(heldOutField(*comparison, workbench_.table(), QString(), QString(), tr("Before correction")));
  after_->setField(
      heldOutField(*comparison, workbench_.table(), method, turned, tr("After: %1, places it did not see").arg(label)));
  histogram_->setSeries({tr("Before"), label},
                        {heldOutErrors_mm(*comparison, QString()), heldOutErrors_mm(*comparison, method)},
                        tr("Position error on places the fit did not see [mm]"));
}

void ComparePage::fitChosen() {
  CorrectorChoice choice;
  choice.position_id = position_->method().toStdString();
  choice.position_settings = position_->settings();
  choice.orientation_id = rotation_->method().toStdString();
  choice.orientation_settings = rotation_->settings();
  workbench_.fit(choice, defaultAlignMode(workbench_.table().metadata));
}

void ComparePage::onCorrector() {
  const std::optional<Corrector>& corrector = workbench_.corrector();
  if (!corrector) {
    fitted_->clear();
    return;
  }
  const FitReport& report = corrector->report();
  fitted_->setText(tr("Fitted on %1 rows; what is left on those same rows (no verdict): RMS %2. Kept in the session, "
                      "ready to export.")
                       .arg(report.n_nodes)
                       .arg(errorText(report.rms_m)));
}

void ComparePage::selectNode(int node) {
  before_->setSelected(node);
  after_->setSelected(node);
  hovered_->setText(describeNode(node));
}

QString ComparePage::describeNode(int node) const {
  const std::optional<Comparison>& comparison = workbench_.comparison();
  if (!comparison) return {};
  for (std::size_t i = 0; i < comparison->places.size(); ++i) {
    if (comparison->places[i] != node) continue;
    const std::vector<double> after_mm = heldOutErrors_mm(*comparison, position_->method());
    return tr("Place %1: before %2 mm, after %3 mm")
        .arg(node)
        .arg(threeFigures(comparison->before_place_mm[i]), threeFigures(after_mm[i]));
  }
  return {};
}

}  // namespace fieldtrue
