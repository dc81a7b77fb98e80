#include "widgets/pages/gap_page.h"

#include <QCheckBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QPointer>
#include <QProgressBar>
#include <QPushButton>
#include <QSplitter>
#include <QStackedWidget>
#include <QStyle>
#include <QVBoxLayout>
#include <algorithm>

#include "acquisition/session/recorded_table.h"
#include "calib/core/file_io.h"
#include "calib/gap/diagnosis.h"
#include "calib/gap/first_look.h"
#include "calib/gap/report_json.h"
#include "calib/recording/unit_slip.h"
#include "calib/tables/table_sensors.h"
#include "widgets/figures/field_scale.h"
#include "widgets/figures/gap_bars.h"
#include "widgets/figures/gap_field.h"
#include "widgets/forms/empty_page.h"
#include "widgets/forms/sensor_choice.h"
#include "widgets/pages/gap_inspector.h"
#include "widgets/pages/kept_gap.h"
#include "widgets/report/gap_section.h"
#include "widgets/style/theme.h"
#include "widgets/views/draw_picture.h"
#include "widgets/views/field/field_view.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kFewestRows = 12;
constexpr int kGapInspectorWidth = 400;
constexpr int kReplicates = 50;
constexpr double kProgressSteps = 1000.0;
constexpr double kFirstShare = 0.15;  ///< Of the progress: a first look at some of the places.

Result<gap::GapReport> diagnoseWithCalib(const CalibrationTable& table, const SampleTable* samples,
                                         const simulation::Scene* scene, const gap::DiagnosisOptions& options,
                                         const RunControl& control) {
  return gap::diagnose(table, samples, scene, options, control);
}

}  // namespace

GapPage::GapPage(Workbench& workbench, Diagnose diagnose, QWidget* parent)
    : QWidget(parent), workbench_(workbench), diagnose_(diagnose ? std::move(diagnose) : diagnoseWithCalib) {
  auto* content = new QWidget(this);
  auto* rows = new QVBoxLayout(content);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->setSpacing(0);
  rows->addWidget(makeHeader());
  auto* splitter = new QSplitter(content);
  splitter->addWidget(makeFieldSide());
  inspector_ = new GapInspector(splitter);
  splitter->addWidget(inspector_);
  splitter->setStretchFactor(0, 1);
  splitter->setSizes({880, kGapInspectorWidth});
  splitter->setCollapsible(0, false);
  rows->addWidget(splitter, 1);
  stack_ = new QStackedWidget(this);
  stack_->addWidget(new EmptyPage(
      tr("Nothing to diagnose yet."),
      tr("At least %1 places must be taken; then the recording is held against the simulation.").arg(kFewestRows),
      {{tr("Acquire"), [this] { workbench_.goToPage(QStringLiteral("acquire")); }},
       {tr("Run the demonstration"), [this] { workbench_.startDemonstration(); }}},
      this));
  stack_->addWidget(content);
  stack_->addWidget(makeOpeningPage(this));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(stack_);
  connect(&workbench_, &Workbench::tableChanged, this, [this] {
    setRecording(workbench_.table(), [this] {
      const std::optional<int> sensor = workbench_.chosenSensor();
      return sensor ? rowsOfSensor(workbench_.samples(), *sensor) : workbench_.samples();
    });
    restore();
  });
  connect(&workbench_, &Workbench::sessionChanged, this, [this] {
    scene_.reset();
    earlier_.clear();
    setRecording({}, {});
    is_restored_ = has_changed_ = false;
  });
  connect(&workbench_, &Workbench::closing, this, [this] { jobs_.stop(); });
  setRecording(workbench_.table(), {});
}

GapPage::~GapPage() = default;

QWidget* GapPage::makeHeader() {
  header_ = new QWidget(this);
  header_->setObjectName(QStringLiteral("verdictBar"));
  header_->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(header_);
  layout->setContentsMargins(20, 8, 20, 8);
  layout->setSpacing(20);
  auto* texts = new QVBoxLayout;
  texts->setSpacing(2);
  const auto add = [&](const char* name, const char* role) {
    auto* label = new QLabel(header_);
    label->setObjectName(QLatin1String(name));
    label->setProperty("role", role);
    label->setWordWrap(true);
    label->setTextInteractionFlags(Qt::TextSelectableByMouse);
    texts->addWidget(label);
    return label;
  };
  headline_ = add("headline", "headline");
  sentence_ = add("gapSentence", "heading");
  next_ = add("gapNext", "");
  believed_ = add("gapBelieved", "muted");
  layout->addLayout(texts, 1);
  layout->addWidget(makeButtons(header_), 0, Qt::AlignTop);
  return header_;
}

QPushButton* GapPage::addButton(QWidget* parent, const QString& words, const char* name, void (GapPage::*slot)()) {
  auto* button = new QPushButton(words, parent);
  button->setObjectName(QLatin1String(name));
  connect(button, &QPushButton::clicked, this, slot);
  return button;
}

QWidget* GapPage::makeButtons(QWidget* header) {
  auto* buttons = new QWidget(header);
  auto* grid = new QGridLayout(buttons);
  grid->setContentsMargins(0, 4, 0, 0);
  run_ = addButton(buttons, tr("&Diagnose"), "diagnose", &GapPage::runOrStop);
  choose_ = addButton(buttons, tr("&Believed scene..."), "chooseScene", &GapPage::chooseScene);
  add_ = addButton(buttons, tr("&Add to the simulation"), "addToSimulation", &GapPage::addToSimulation);
  trust_ = addButton(buttons, tr("How far to &trust it"), "trustGap", &GapPage::tryAgainAndAgain);
  trust_->setToolTip(
      tr("Makes the recording %1 times again under what was found and diagnoses each.").arg(kReplicates));
  since_ = addButton(buttons, tr("Changed si&nce..."), "gapAgainst", &GapPage::chooseEarlier);
  since_->setToolTip(tr("What changed since an earlier recording of this room, of the same or of other places?"));
  undo_ = addButton(buttons, tr("&Undo"), "undoAdd", &GapPage::undo);
  save_report_ = addButton(buttons, tr("Save &report..."), "saveGapReport", &GapPage::chooseReportFile);
  save_scene_ = addButton(buttons, tr("Save s&cene..."), "saveGapScene", &GapPage::chooseSceneFile);
  progress_ = new QProgressBar(buttons);
  progress_->setObjectName(QStringLiteral("gapProgress"));
  progress_->setRange(0, static_cast<int>(kProgressSteps));
  progress_->setAccessibleName(tr("Diagnosis"));
  QPushButton* order[] = {run_, choose_, add_, undo_, save_report_, save_scene_, trust_, since_};
  for (int i = 0; i < 8; ++i) grid->addWidget(order[i], i / 2, i % 2);
  grid->addWidget(progress_, 4, 0, 1, 2);
  grid->addWidget(new SensorChoice(workbench_, QStringLiteral("gapSensor"), buttons), 5, 0, 1, 2);
  return buttons;
}

QWidget* GapPage::makeFieldSide() {
  auto* side = new QWidget(this);
  auto* layout = new QVBoxLayout(side);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(0);
  after_ = new QCheckBox(tr("Show what is &left with the causes added"), side);
  after_->setObjectName(QStringLiteral("showAfter"));
  connect(after_, &QCheckBox::toggled, this, &GapPage::showField);
  field_ = new FieldView(side);
  field_->setObjectName(QStringLiteral("gapField"));
  auto* switch_row = new QHBoxLayout;
  switch_row->setContentsMargins(20, 8, 12, 8);
  switch_row->addWidget(after_);
  layout->addLayout(switch_row);
  layout->addWidget(field_, 1);
  return side;
}

void GapPage::setRecording(const CalibrationTable& table, std::function<SampleTable()> samples) {
  has_changed_ = has_changed_ || report_ || isDiagnosing();
  jobs_.stop();
  table_ = table;
  samples_ = std::move(samples);
  report_.reset();
  provisional_.reset();
  against_.reset();
  for (Earlier& earlier : earlier_) earlier.report.reset();
  const auto usable = std::count_if(table_.nodes.begin(), table_.nodes.end(),
                                    [](const Node& node) { return node.role != NodeRole::kSkipped; });
  stack_->setCurrentIndex(static_cast<std::size_t>(usable) >= kFewestRows ? 1 : workbench_.isOpening() ? 2 : 0);
  showReport();
}

void GapPage::setScene(const std::optional<simulation::Scene>& scene) {
  jobs_.stop();
  scene_ = scene;
  earlier_.clear();
  report_.reset();
  provisional_.reset();
  against_.reset();
  showReport();
}

void GapPage::runOrStop() {
  if (isDiagnosing()) {
    jobs_.stop();
    showReport();
  } else {
    run();
  }
}

void GapPage::tryAgainAndAgain() {
  gap::DiagnosisOptions options;
  options.replicates = kReplicates;
  options.against = against_;
  run(options, against_name_);
}

void GapPage::chooseEarlier() {
  const QString path =
      QFileDialog::getOpenFileName(this, tr("Earlier recording of this room"), Workbench::sessionFolder(),
                                   tr("Sessions and node tables (*.fieldtrue *.csv)"));
  if (!path.isEmpty()) diagnoseSince(path);
}

void GapPage::diagnoseSince(const QString& path) {
  if (workbench_.sessionIsOpen() && QFileInfo(path) == QFileInfo(workbench_.sessionPath())) {
    workbench_.showMessage({tr("%1 is the session that is open; choose an earlier recording of this room.")
                                .arg(QFileInfo(path).fileName()),
                            Severity::kAttention,
                            {},
                            {}});
    return;
  }
  auto earlier = acquisition::recordedTable(path);
  if (!earlier) {
    workbench_.showMessage({QString::fromStdString(earlier.error().message), Severity::kAttention, {}, {}});
    return;
  }
  const auto table = std::make_shared<const CalibrationTable>(*std::move(earlier));
  const auto hold = [page = QPointer(this), table, name = QFileInfo(path).fileName()] {
    if (!page) return;
    gap::DiagnosisOptions options;
    options.against = table;
    page->run(options, name);
  };
  if (const auto units = recording::checkUnits(*table); !units) {
    workbench_.showMessage(
        {QString::fromStdString(units.error().message) + '.', Severity::kAttention, tr("Use anyway"), hold});
    return;
  }
  hold();
}

void GapPage::run(const gap::DiagnosisOptions& options, const QString& against_name) {
  jobs_.stop();
  if (!workbench_.mayUse(table_, [page = QPointer(this), options, against_name] {
        if (page) page->run(options, against_name);
      }))
    return showReport();
  has_changed_ = false;
  progress_->setValue(0);
  provisional_.reset();
  const bool is_first = !report_ && !options.against && options.replicates == 0;
  if (const auto first = is_first ? gap::firstLook(table_) : std::nullopt) {
    diagnoseIn(kFirstShare, *first, {}, options, [this, options, against_name](Result<gap::GapReport> result) {
      diagnoseAll(options, against_name);
      if (result) provisional_ = std::move(*result);
      showReport();
    });
  } else {
    diagnoseAll(options, against_name);
  }
  showReport();
}

void GapPage::diagnoseAll(const gap::DiagnosisOptions& options, const QString& against_name) {
  diagnoseIn(1.0, table_, samples_ ? samples_() : SampleTable(), options,
             [this, against = options.against, against_name](Result<gap::GapReport> result) {
               onResult(std::move(result), against, against_name);
             });
}

/// Goes on from where the progress is to `to`.
void GapPage::diagnoseIn(double to, const CalibrationTable& table, SampleTable samples,
                         const gap::DiagnosisOptions& options, std::function<void(Result<gap::GapReport>)> done) {
  const double from = progress_->value() / kProgressSteps;
  jobs_.run(
      [diagnose = diagnose_, table, samples = std::move(samples), scene = scene_, options](const RunControl& control) {
        return diagnose(table, samples.rows.empty() ? nullptr : &samples, scene ? &*scene : nullptr, options, control);
      },
      std::move(done),
      [this, from, to](double fraction) {
        progress_->setValue(static_cast<int>((from + (to - from) * fraction) * kProgressSteps));
      });
}

void GapPage::onResult(Result<gap::GapReport> result, std::shared_ptr<const CalibrationTable> against,
                       const QString& against_name) {
  provisional_.reset();
  if (result) {
    report_ = std::move(*result);
    against_ = std::move(against);
    against_name_ = against_name;
    keep();
  } else {
    report_.reset();
    against_.reset();
    if (result.error().code != ErrorCode::kCancelled)
      workbench_.showMessage({QString::fromStdString(result.error().message), Severity::kAttention, {}, {}});
  }
  showReport();
}

/// Whether a cause was found that a scene can hold; what ails the signal alone is none.
bool GapPage::canAdd() const {
  return report_ && !report_->against &&
         std::any_of(report_->selected.begin(), report_->selected.end(),
                     [](const gap::SelectedEffect& effect) { return effect.scene_parameters.is_object(); });
}

void GapPage::addToSimulation() {
  if (!canAdd()) return;
  simulation::Scene updated = gap::updatedScene(scene_.value_or(simulation::Scene{}), table_.metadata, *report_);
  earlier_.push_back({std::move(scene_), std::move(report_)});
  scene_ = std::move(updated);
  report_.reset();
  keep();
  run();
}

void GapPage::undo() {
  if (earlier_.empty()) return;
  jobs_.stop();
  scene_ = std::move(earlier_.back().scene);
  report_ = std::move(earlier_.back().report);
  provisional_.reset();
  earlier_.pop_back();
  against_.reset();
  keep();
  showReport();
}

/// What the session opens with again; a comparison with an earlier recording is of the day.
void GapPage::keep() {
  if (against_) return;
  KeptGap kept{scene_, {}, report_};
  for (const Earlier& earlier : earlier_) kept.earlier.push_back(earlier.scene);
  workbench_.keepGap(QString::fromStdString(toText(kept, table_)));
}

void GapPage::restore() {
  if (is_restored_ || table_.nodes.empty()) return;
  is_restored_ = true;
  if (workbench_.keptGap().isEmpty()) return;
  auto kept = readKeptGap(workbench_.keptGap().toStdString(), table_, workbench_.sessionPath().toStdString());
  if (!kept) {
    workbench_.showMessage({QString::fromStdString(kept.error().message), Severity::kAttention, {}, {}});
    return;
  }
  scene_ = std::move(kept->scene);
  earlier_.clear();
  for (auto& scene : kept->earlier) earlier_.push_back({std::move(scene), std::nullopt});
  report_ = std::move(kept->report);
  showReport();
}

void GapPage::chooseScene() {
  const QString path =
      QFileDialog::getOpenFileName(this, tr("Scene the simulator believes"), {}, tr("Scenes (*.scene.json)"));
  if (path.isEmpty()) return;
  auto scene = simulation::readScene(path.toStdString());
  if (!scene) {
    workbench_.showMessage({QString::fromStdString(scene.error().message), Severity::kAttention, {}, {}});
    return;
  }
  setScene(*scene);
  keep();
}

void GapPage::chooseReportFile() {
  const QString path = QFileDialog::getSaveFileName(this, tr("Save the diagnosis"), QStringLiteral("room.gap.json"),
                                                    tr("Gap reports (*.gap.json)"));
  if (!path.isEmpty()) tell(saveReport(path), path);
}

void GapPage::chooseSceneFile() {
  const QString path = QFileDialog::getSaveFileName(this, tr("Save the scene"), QStringLiteral("room.scene.json"),
                                                    tr("Scenes (*.scene.json)"));
  if (!path.isEmpty()) tell(saveScene(path), path);
}

void GapPage::tell(const Result<void>& written, const QString& path) {
  workbench_.showMessage(written ? Message{tr("Written to %1.").arg(path), Severity::kInfo, {}, {}}
                                 : Message{QString::fromStdString(written.error().message), Severity::kDanger, {}, {}});
}

Result<void> GapPage::saveReport(const QString& path) const {
  if (!report_) return fail(ErrorCode::kBadInput, "There is no diagnosis to save yet; press Diagnose first");
  if (const auto written = gap::writeGapReport(path.toStdString(), *report_); !written) return written;
  return writeGapHtml(*report_, drawPictures, (path + QStringLiteral(".html")).toStdString(), &table_);
}

Result<void> GapPage::saveScene(const QString& path) const {
  const simulation::Scene scene = scene_.value_or(simulation::Scene{});
  return writeFileAtomically(path.toStdString(), [&](std::ostream& out) { out << toJson(scene).dump(2) << '\n'; });
}

void GapPage::showReport() {
  showWords();
  showField();
  inspector_->setReport(shown());
  showButtons();
  workbench_.setGapReport(report_);
}

void GapPage::showWords() {
  believed_->setText(against_ ? tr("Held against %1, whatever was wrong then.").arg(against_name_)
                     : scene_
                         ? tr("The simulation holds %n effect(s).", nullptr, static_cast<int>(scene_->effects.size()))
                         : tr("The simulation is an ideal tracker in free space."));
  const std::optional<gap::GapReport>& report = shown();
  const bool matches =
      report_ && (report_->verdict == gap::GapVerdict::kNoGap ||
                  (report_->verdict == gap::GapVerdict::kExplained && gap::isSurelyExplained(*report_)));
  header_->setProperty("state", !report_ ? "" : matches ? "apply" : "leave");
  for (QWidget* widget : {header_, static_cast<QWidget*>(headline_)}) restyle(*widget);
  QString next;
  if (report) {
    const QString headline = QString::fromStdString(gapHeadline(*report));
    const QString sentence = QString::fromStdString(report->text);
    headline_->setText(report_ ? headline : tr("Provisional: %1").arg(headline));
    sentence_->setText(report_ ? sentence
                               : tr("By %1 of the places; all of them are %2. %3")
                                     .arg(report->input.places)
                                     .arg(isDiagnosing() ? tr("being looked at") : tr("yet to be looked at"))
                                     .arg(sentence));
    if (report_) next = QString::fromStdString(report->next_measurement);
    if (!next.isEmpty()) next = tr("Next measurement: %1").arg(next);
  } else {
    headline_->setText(isDiagnosing() ? tr("Diagnosing...") : tr("Not diagnosed yet"));
    sentence_->setText(isDiagnosing()                    ? tr("Trying every known cause on places it has not seen.")
                       : !workbench_.refusal().isEmpty() ? workbench_.refusal()
                       : has_changed_ ? tr("The places have changed since the last diagnosis. Press Diagnose.")
                                      : tr("Press Diagnose to see where simulation and recording differ, and why."));
  }
  next_->setText(next);
  next_->setVisible(!next.isEmpty());
}

void GapPage::showField() {
  const std::optional<gap::GapReport>& report = shown();
  if (!report) {
    field_->setField({});
    return;
  }
  const FieldScale scale = fieldScale(gapField(*report, false, &table_));
  field_->setField(gapField(*report, after_->isChecked(), &table_));
  field_->setScaleMax_mm(scale.max_mm);
  field_->setMagnification(scale.magnification);
}

void GapPage::showButtons() {
  run_->setText(isDiagnosing() ? tr("&Stop") : report_ ? tr("&Diagnose again") : tr("&Diagnose"));
  setStyled(*run_, "primary", !report_);
  const bool can_add = !isDiagnosing() && canAdd();
  setStyled(*add_, "primary", can_add);
  add_->setEnabled(can_add);
  undo_->setEnabled(!earlier_.empty());
  trust_->setEnabled(!isDiagnosing() && report_ && !report_->replicates);
  choose_->setEnabled(!isDiagnosing());
  since_->setEnabled(!isDiagnosing());
  save_report_->setEnabled(!isDiagnosing() && report_.has_value());
  save_scene_->setEnabled(!isDiagnosing());
  after_->setEnabled(shown().has_value());
  progress_->setVisible(isDiagnosing());
  header_->layout()->activate();
}

}  // namespace fieldtrue::widgets
