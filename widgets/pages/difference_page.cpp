#include "widgets/pages/difference_page.h"

#include <QComboBox>
#include <QFileDialog>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QProgressBar>
#include <QPushButton>
#include <QScrollArea>
#include <QSignalBlocker>
#include <QSplitter>
#include <QStyle>
#include <QVBoxLayout>
#include <algorithm>
#include <utility>

#include "widgets/figures/difference_field.h"
#include "widgets/figures/field_scale.h"
#include "widgets/report/difference_text.h"
#include "widgets/views/field/field_view.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kFactsWidth = 400;
constexpr int kProgressSteps = 1000;

using evaluation::CalibrationDifference;
using evaluation::DifferenceVerdict;

QString headlineOf(DifferenceVerdict verdict) {
  switch (verdict) {
    case DifferenceVerdict::kChanged:
      return DifferencePage::tr("The field changed");
    case DifferenceVerdict::kNotShown:
      return DifferencePage::tr("No change is shown");
    case DifferenceVerdict::kCannotTell:
      break;
  }
  return DifferencePage::tr("Nobody can tell");
}

}  // namespace

DifferencePage::DifferencePage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  auto* rows = new QVBoxLayout(this);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->setSpacing(0);
  rows->addWidget(makeHeader());
  auto* splitter = new QSplitter(this);
  field_ = new FieldView(splitter);
  field_->setObjectName(QStringLiteral("differenceField"));
  splitter->addWidget(field_);
  splitter->addWidget(makeFacts());
  splitter->setStretchFactor(0, 1);
  splitter->setSizes({880, kFactsWidth});
  splitter->setCollapsible(0, false);
  rows->addWidget(splitter, 1);
  connect(&workbench_, &Workbench::correctorChanged, this, &DifferencePage::onSessionCalibration);
  connect(&workbench_, &Workbench::earlierCalibrationChosen, first_, &QLineEdit::setText);
  connect(&workbench_, &Workbench::closing, this, [this] { jobs_.stop(); });
  showDifference();
}

QWidget* DifferencePage::makeHeader() {
  auto* header = new QWidget(this);
  header->setObjectName(QStringLiteral("verdictBar"));
  header->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(header);
  layout->setContentsMargins(20, 8, 20, 8);
  layout->setSpacing(20);
  auto* texts = new QVBoxLayout;
  texts->setSpacing(2);
  headline_ = new QLabel(header);
  headline_->setObjectName(QStringLiteral("differenceHeadline"));
  headline_->setProperty("role", "headline");
  sentence_ = new QLabel(header);
  sentence_->setObjectName(QStringLiteral("differenceSentence"));
  sentence_->setProperty("role", "heading");
  for (QLabel* label : {headline_, sentence_}) {
    label->setWordWrap(true);
    label->setTextInteractionFlags(Qt::TextSelectableByMouse);
    texts->addWidget(label);
  }
  layout->addLayout(texts, 1);
  auto* files = new QWidget(header);
  auto* grid = new QGridLayout(files);
  grid->setContentsMargins(0, 4, 0, 0);
  first_ = addFileRow(grid, tr("Earlier"), "differenceFirst");
  second_ = addFileRow(grid, tr("Later"), "differenceSecond");
  sensor_label_ = new QLabel(tr("Sensor"), files);
  sensor_ = new QComboBox(files);
  sensor_->setObjectName(QStringLiteral("differenceSensor"));
  sensor_->setAccessibleName(tr("Sensor"));
  showSensors({}, 0);
  grid->addWidget(sensor_label_, 2, 0);
  grid->addWidget(sensor_, 2, 1);
  run_ = new QPushButton(files);
  run_->setObjectName(QStringLiteral("differenceRun"));
  progress_ = new QProgressBar(files);
  progress_->setRange(0, kProgressSteps);
  progress_->setAccessibleName(tr("Comparison of calibrations"));
  grid->addWidget(run_, 3, 2);
  grid->addWidget(progress_, 3, 1);
  layout->addWidget(files, 0, Qt::AlignTop);
  connect(run_, &QPushButton::clicked, this, &DifferencePage::runOrStop);
  connect(sensor_, &QComboBox::activated, this, [this] {
    jobs_.stop();
    run();
  });
  return header;
}

QLineEdit* DifferencePage::addFileRow(QGridLayout* grid, const QString& label, const char* name) {
  const int row = grid->rowCount() == 1 && grid->count() == 0 ? 0 : grid->rowCount();
  auto* path = new QLineEdit;
  path->setObjectName(QLatin1String(name));
  path->setAccessibleName(label);
  path->setMinimumWidth(kFactsWidth / 2);
  auto* browse = new QPushButton(tr("Choose..."));
  grid->addWidget(new QLabel(label), row, 0);
  grid->addWidget(path, row, 1);
  grid->addWidget(browse, row, 2);
  connect(browse, &QPushButton::clicked, this, [this, path] { choose(path); });
  connect(path, &QLineEdit::textChanged, this, &DifferencePage::forget);
  return path;
}

QWidget* DifferencePage::makeFacts() {
  auto* area = new QScrollArea(this);
  area->setWidgetResizable(true);
  area->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  area->setMinimumWidth(320);
  area->setObjectName(QStringLiteral("inspector"));
  auto* inner = new QWidget(area);
  auto* layout = new QVBoxLayout(inner);
  layout->setContentsMargins(12, 12, 12, 12);
  facts_ = new QGridLayout;
  facts_->setVerticalSpacing(12);
  layout->addLayout(facts_);
  layout->addStretch();
  area->setWidget(inner);
  return area;
}

void DifferencePage::choose(QLineEdit* path) {
  const QString chosen = QFileDialog::getOpenFileName(this, tr("Choose a calibration"), Workbench::sessionFolder(),
                                                      tr("Calibrations (*.ftcal.json)"));
  if (!chosen.isEmpty()) path->setText(chosen);
}

void DifferencePage::runOrStop() {
  if (!jobs_.busy()) return run();
  jobs_.stop();
  showButtons();
}

Result<DifferencePage::Compared> DifferencePage::compare(const calibration::Corrector& first,
                                                         const calibration::Corrector& second, int wanted,
                                                         const RunControl& control) {
  Compared compared;
  FT_TRY(compared.sensors, evaluation::sensorsToChooseFrom(first, second));
  if (compared.sensors.empty()) {
    FT_TRY(compared.difference, evaluation::compareCalibrations(first, second, control));
    return compared;
  }
  const bool is_there = std::find(compared.sensors.begin(), compared.sensors.end(), wanted) != compared.sensors.end();
  compared.sensor = is_there ? wanted : compared.sensors.front();
  FT_TRY(const calibration::Corrector of_first, first.ofSensor(compared.sensor));
  FT_TRY(const calibration::Corrector of_second, second.ofSensor(compared.sensor));
  FT_TRY(compared.difference, evaluation::compareCalibrations(of_first, of_second, control));
  return compared;
}

void DifferencePage::run() {
  progress_->setValue(0);
  using calibration::Corrector;
  const auto session = workbench_.corrector();
  jobs_.run(
      [first_path = first_->text(), second_path = second_->text(), session,
       wanted = sensor_->currentData().toInt()](const RunControl& control) -> Result<Compared> {
        FT_TRY(const Corrector first, Corrector::load(first_path.toStdString()));
        if (second_path.isEmpty() && session) return compare(first, *session, wanted, control);
        FT_TRY(const Corrector second, Corrector::load(second_path.toStdString()));
        return compare(first, second, wanted, control);
      },
      [this](Result<Compared> result) { onResult(std::move(result)); },
      [this](double fraction) { progress_->setValue(static_cast<int>(fraction * kProgressSteps)); });
  showButtons();
}

void DifferencePage::onResult(Result<Compared> result) {
  difference_.reset();
  if (result) {
    showSensors(result->sensors, result->sensor);
    difference_ = std::move(result->difference);
  } else {
    workbench_.showMessage({QString::fromStdString(result.error().message), Severity::kDanger, {}, {}});
  }
  showDifference();
}

void DifferencePage::showSensors(const std::vector<int>& sensors, int sensor) {
  const QSignalBlocker quiet(sensor_);
  sensor_->clear();
  for (const int one : sensors) sensor_->addItem(tr("Sensor %1").arg(one), one);
  sensor_->setCurrentIndex(sensor_->findData(sensor));
  sensor_label_->setVisible(!sensors.empty());
  sensor_->setVisible(!sensors.empty());
}

/// What was told is of other calibrations.
void DifferencePage::forget() {
  jobs_.stop();
  difference_.reset();
  showSensors({}, 0);
  showDifference();
}

void DifferencePage::onSessionCalibration() {
  if (second_->text().isEmpty()) return forget();
  showButtons();
}

void DifferencePage::showButtons() {
  const bool busy = jobs_.busy();
  run_->setText(busy ? tr("Stop") : tr("Tell what changed"));
  run_->setEnabled(busy || (!first_->text().isEmpty() && (!second_->text().isEmpty() || workbench_.corrector())));
  progress_->setVisible(busy);
  second_->setPlaceholderText(workbench_.corrector() ? tr("this session's calibration") : tr("a calibration file"));
  first_->setPlaceholderText(tr("a calibration file"));
}

void DifferencePage::showDifference() {
  showButtons();
  while (QLayoutItem* item = facts_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  if (!difference_) {
    headline_->setText(tr("What changed?"));
    sentence_->setText(
        tr("Choose a calibration that was made before, and hold the session's, or a later file, against it."));
    field_->setField({});
    return;
  }
  headline_->setText(headlineOf(difference_->verdict));
  sentence_->setText(QString::fromStdString(difference_->text));
  const ErrorField field = differenceField(*difference_);
  const FieldScale scale = fieldScale(field);
  field_->setField(field);
  field_->setScaleMax_mm(scale.max_mm);
  field_->setMagnification(scale.magnification);
  int row = 0;
  for (const auto& [label, text] : differenceFacts(*difference_)) {
    auto* name = new QLabel(QString::fromStdString(label));
    name->setProperty("role", "muted");
    auto* told = new QLabel(QString::fromStdString(text));
    told->setTextInteractionFlags(Qt::TextSelectableByMouse);
    for (QLabel* part : {name, told}) {
      part->setWordWrap(true);
      facts_->addWidget(part, row, part == name ? 0 : 1, Qt::AlignTop);
    }
    ++row;
  }
  facts_->setColumnStretch(1, 1);
}

}  // namespace fieldtrue::widgets
