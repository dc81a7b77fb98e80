#include "widgets/pages/export_page.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDesktopServices>
#include <QDir>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QProgressBar>
#include <QPushButton>
#include <QSignalBlocker>
#include <QStackedWidget>
#include <QUrl>
#include <QVBoxLayout>

#include "calib/core/setup.h"
#include "widgets/compare/method_list.h"
#include "widgets/forms/empty_page.h"
#include "widgets/forms/number_box.h"
#include "widgets/workbench/compared_methods.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kExportColumnWidth = 720;
constexpr int kRowHeight = 36;
constexpr int kMostRows = 12;
constexpr int kGap = 24;
constexpr int kExportSteps = 1000;
constexpr double kLeastDeviation_mm = 0.001;
constexpr double kUsualDeviation_mm = 0.05;
constexpr double kMostDeviation_mm = 10.0;

}  // namespace

ExportPage::ExportPage(Workbench& workbench, QWidget* parent)
    : QWidget(parent), workbench_(workbench), targets_(exportTargets(workbench)) {
  auto* content = new QWidget(this);
  auto* outer = new QHBoxLayout(content);
  auto* column = new QWidget(content);
  column->setMaximumWidth(kExportColumnWidth);
  auto* layout = new QVBoxLayout(column);
  layout->setSpacing(12);
  auto* title = new QLabel(tr("Export"), column);
  title->setProperty("role", "title");
  calibration_ = new QLabel(column);
  calibration_->setObjectName(QStringLiteral("calibrationSummary"));
  calibration_->setWordWrap(true);
  list_ = new QListWidget(column);
  list_->setObjectName(QStringLiteral("exportList"));
  list_->setAccessibleName(tr("What to write"));
  about_ = new QLabel(column);
  about_->setProperty("role", "muted");
  about_->setWordWrap(true);
  path_ = new QLineEdit(column);
  path_->setObjectName(QStringLiteral("exportPath"));
  path_->setAccessibleName(tr("File to write"));
  auto* browse_button = new QPushButton(tr("Choose..."), column);
  write_ = new QPushButton(tr("Write the file"), column);
  write_->setObjectName(QStringLiteral("exportWrite"));
  write_->setProperty("primary", true);
  sensor_ = new QComboBox(column);
  sensor_->setObjectName(QStringLiteral("exportSensor"));
  sensor_->setAccessibleName(tr("The sensor whose correction is written"));
  sensor_->setToolTip(sensor_->accessibleName());
  connect(sensor_, &QComboBox::currentIndexChanged, this, &ExportPage::onTarget);
  auto* row = new QHBoxLayout;
  row->addWidget(sensor_);
  row->addWidget(path_, 1);
  row->addWidget(browse_button);
  row->addWidget(write_);
  progress_ = new QProgressBar(column);
  progress_->setRange(0, kExportSteps);
  progress_->setAccessibleName(tr("Files being written"));
  stop_ = new QPushButton(tr("Stop"), column);
  stop_->setObjectName(QStringLiteral("exportStop"));
  row->addWidget(progress_);
  row->addWidget(stop_);
  layout->addStretch(1);
  layout->addWidget(title);
  layout->addWidget(calibration_);
  list_->setMaximumHeight(kMostRows * kRowHeight);
  layout->addWidget(list_, kMostRows);
  layout->addWidget(about_);
  layout->addWidget(makeBake());
  layout->addLayout(row);
  layout->addStretch(1);
  outer->addStretch();
  outer->addWidget(column, 1);
  outer->addStretch();

  stack_ = new QStackedWidget(this);
  stack_->addWidget(new EmptyPage(tr("There is nothing to export yet."),
                                  tr("Take places first; then compare the methods and fit the one you choose."),
                                  {{tr("Compare"), [this] { workbench_.goToPage(QStringLiteral("compare")); }}}, this));
  stack_->addWidget(content);
  auto* page = new QVBoxLayout(this);
  page->setContentsMargins(0, 0, 0, 0);
  page->addWidget(stack_);

  fillList();
  connect(list_, &QListWidget::currentRowChanged, this, &ExportPage::onTarget);
  connect(list_, &QListWidget::itemChanged, this, &ExportPage::onTarget);
  connect(stop_, &QPushButton::clicked, this, &ExportPage::stop);
  connect(&workbench_, &Workbench::closing, this, [this] { jobs_.stop(); });
  connect(browse_button, &QPushButton::clicked, this, &ExportPage::browse);
  connect(write_, &QPushButton::clicked, this, &ExportPage::write);
  connect(&workbench_, &Workbench::correctorChanged, this, &ExportPage::onData);
  connect(&workbench_, &Workbench::sessionChanged, this, &ExportPage::onData);
  connect(&workbench_, &Workbench::tableChanged, this, &ExportPage::onData);
  connect(&workbench_, &Workbench::comparisonChanged, this, [this] {
    if (stack_->currentIndex() == 1) showCalibration();
  });
  list_->setCurrentItem(items_.front());
  onData();
}

void ExportPage::fillList() {
  QString section;
  for (std::size_t at = 0; at < targets_.size(); ++at) {
    const ExportTarget& target = targets_[at];
    if (target.section != section) {
      section = target.section;
      auto* heading = new QListWidgetItem(section, list_);
      heading->setFlags(Qt::NoItemFlags);
      heading->setSizeHint(QSize(0, kRowHeight));
      QFont bold = list_->font();
      bold.setBold(true);
      heading->setFont(bold);
    }
    auto* item = new QListWidgetItem(QStringLiteral("    %1   (%2)").arg(target.label, target.extension), list_);
    item->setSizeHint(QSize(0, kRowHeight));
    item->setData(Qt::UserRole, static_cast<int>(at));
    item->setFlags(item->flags() | Qt::ItemIsUserCheckable);
    item->setCheckState(Qt::Unchecked);
    items_.push_back(item);
  }
}

QWidget* ExportPage::makeBake() {
  bake_row_ = new QWidget(this);
  pitch_ = new QLabel(tr("The lattice is off the method by at most"), bake_row_);
  inverse_ = new QCheckBox(tr("True to measured, for programs that resample"), bake_row_);
  inverse_->setObjectName(QStringLiteral("exportInverse"));
  connect(inverse_, &QCheckBox::toggled, this, &ExportPage::onTarget);
  bake_ = new QCheckBox(tr("Bake to a lattice that is fast to evaluate, off the method by at most"), bake_row_);
  bake_->setObjectName(QStringLiteral("exportBake"));
  deviation_ = new NumberBox(bake_row_);
  deviation_->setObjectName(QStringLiteral("exportDeviation"));
  deviation_->setAccessibleName(tr("Largest deviation of the lattice from the method"));
  deviation_->setDecimals(3);
  deviation_->setRange(kLeastDeviation_mm, kMostDeviation_mm);
  deviation_->setValue(kUsualDeviation_mm);
  deviation_->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
  deviation_->setSuffix(tr(" mm"));
  connect(bake_, &QCheckBox::toggled, this, [this](bool on) { deviation_->setEnabled(on || pitch_->isVisible()); });
  auto* row = new QHBoxLayout(bake_row_);
  row->setContentsMargins(0, 0, 0, 0);
  row->addWidget(bake_);
  row->addWidget(pitch_);
  row->addWidget(deviation_);
  row->addSpacing(kGap);
  row->addWidget(inverse_);
  row->addStretch(1);
  return bake_row_;
}

void ExportPage::onData() {
  const bool has_something = workbench_.corrector() || !workbench_.recordedTable().nodes.empty();
  stack_->setCurrentIndex(has_something ? 1 : 0);
  if (!has_something) return;
  showCalibration();
  showSensors();
  onTarget();
}

/// Sensors with a correction each, for formats that hold one.
void ExportPage::showSensors() {
  std::vector<int> sensors;
  if (workbench_.corrector()) sensors = workbench_.corrector()->sensorsApart();
  const QSignalBlocker quiet(sensor_);
  const QVariant chosen = sensor_->currentData();
  sensor_->clear();
  for (const int sensor : sensors) sensor_->addItem(tr("Sensor %1").arg(sensor), sensor);
  sensor_->setCurrentIndex(std::max(0, sensor_->findData(chosen)));
}

QString ExportPage::verdictOnCalibration() const {
  if (!workbench_.comparisonIsFinal()) return {};
  const evaluation::Comparison& comparison = *workbench_.comparison();
  const bool applies = comparison.verdict.apply_position;
  const bool corrects = workbench_.corrector()->choice().position_id != "none";
  if (applies && !corrects)
    return tr(" The comparison says to correct position with %1, and this leaves position as it is.")
        .arg(positionLabel(comparison, comparison.best_position_row));
  if (!applies && corrects) return tr(" The comparison says not to correct position.");
  return {};
}

QString ExportPage::setupOfCalibration() const {
  const Setup& setup = workbench_.corrector()->setup();
  return setup.empty() ? tr("not stated") : QString::fromStdString(setupText(setup));
}

void ExportPage::showCalibration() {
  const bool corrects = workbench_.correctorCorrects();
  if (!workbench_.corrector()) {
    calibration_->setText(
        tr("There is no calibration yet: the tables can be written now; a calibration once a method is "
           "fitted on the compare page."));
  } else if (corrects) {
    const calibration::CorrectorChoice& choice = workbench_.corrector()->choice();
    const QString warning =
        workbench_.correctorIsCurrent()
            ? QString()
            : tr(" It was fitted before the session's places changed: fit again on the compare page.");
    calibration_->setText(
        tr("Calibration: %1 for position, %2 for orientation, fitted on %3 rows%7.%4%5 Set-up: %6.")
            .arg(methodLabel(MethodPart::kPosition, choice.position_id, choice.position_settings),
                 methodLabel(MethodPart::kOrientation, choice.orientation_id, choice.orientation_settings))
            .arg(workbench_.corrector()->report().n_nodes)
            .arg(warning, verdictOnCalibration(), setupOfCalibration(),
                 workbench_.corrector()->sensorsApart().empty() ? QString() : tr(", each sensor by itself")));
  } else {
    calibration_->setText(
        tr("The calibration kept in this session corrects nothing, neither position nor orientation: "
           "it cannot be written. Fit a method on the compare page."));
  }
  for (std::size_t row = 0; row < targets_.size(); ++row) {
    QListWidgetItem* item = items_[row];
    const bool offered = corrects || !targets_[row].exporter;
    {
      const QSignalBlocker quiet(list_);
      item->setFlags(offered ? item->flags() | Qt::ItemIsEnabled : item->flags() & ~Qt::ItemIsEnabled);
    }
    if (offered && (!chosen() || !(list_->currentItem()->flags() & Qt::ItemIsEnabled))) list_->setCurrentItem(item);
  }
}

const ExportTarget* ExportPage::chosen() const {
  const QListWidgetItem* item = list_->currentItem();
  if (item == nullptr || !item->data(Qt::UserRole).isValid()) return nullptr;
  return &targets_[static_cast<std::size_t>(item->data(Qt::UserRole).toInt())];
}

std::vector<const ExportTarget*> ExportPage::wanted() const {
  std::vector<const ExportTarget*> wanted;
  for (std::size_t row = 0; row < targets_.size(); ++row)
    if (items_[row]->checkState() == Qt::Checked && (items_[row]->flags() & Qt::ItemIsEnabled))
      wanted.push_back(&targets_[row]);
  return wanted;
}

QString ExportPage::suggestedName(const ExportTarget& target) const {
  QString name = QFileInfo(workbench_.sessionPath()).completeBaseName();
  if (target.exporter && target.exporter->purpose != exporters::Purpose::kFieldtrue && !target.exporter->knows_pose)
    name += target.exporter->may_be_inverse && inverse_->isChecked() ? QStringLiteral("_true-to-measured")
                                                                     : QStringLiteral("_measured-to-true");
  if (target.exporter && !target.exporter->knows_pose && sensor_->count() > 0)
    name += QStringLiteral("_sensor-%1").arg(sensor_->currentData().toInt());
  return name + target.extension;
}

void ExportPage::onTarget() {
  const std::vector<const ExportTarget*> several = wanted();
  const ExportTarget* target = several.size() == 1 ? several.front() : chosen();
  if (!target) return;
  const auto any = [&](const auto& is) {
    const auto of_exporter = [&](const ExportTarget* one) { return one->exporter && is(*one->exporter); };
    return several.empty() ? of_exporter(target) : std::any_of(several.begin(), several.end(), of_exporter);
  };
  const bool is_lattice = any([](const exporters::Exporter& one) { return one.has_free_pitch; });
  const bool can_be_baked = any([](const exporters::Exporter& one) { return one.knows_pose; });
  const bool may_be_inverse = any([](const exporters::Exporter& one) { return one.may_be_inverse; });
  const bool holds_one = any([](const exporters::Exporter& one) { return !one.knows_pose; });
  bake_row_->setVisible(is_lattice || can_be_baked || may_be_inverse);
  sensor_->setVisible(holds_one && sensor_->count() > 0);
  bake_->setVisible(can_be_baked);
  bake_->setEnabled(workbench_.corrector() && !workbench_.corrector()->isBaked());
  pitch_->setVisible(is_lattice);
  deviation_->setVisible(is_lattice || can_be_baked);
  deviation_->setEnabled(is_lattice || (can_be_baked && bake_->isEnabled() && bake_->isChecked()));
  inverse_->setVisible(may_be_inverse);
  about_->setText(several.size() > 1 ? tr("Each file is named after the session and its format.") : target->reads_it);
  write_->setText(several.size() > 1 ? tr("Write %1 files").arg(several.size()) : tr("Write the file"));
  const QString folder = QFileInfo(workbench_.sessionPath()).absolutePath();
  suggest(several.size() > 1 ? folder : folder + QLatin1Char('/') + suggestedName(*target));
  showBusy();
}

/// What was typed or picked stays until another place is suggested.
void ExportPage::suggest(const QString& path) {
  if (path == suggested_) return;
  suggested_ = path;
  path_->setText(path);
}

void ExportPage::showBusy() {
  const bool busy = jobs_.busy();
  progress_->setVisible(busy);
  // A button that goes off under the keyboard hands it to the rail.
  const auto passFocus = [this](QWidget* from, QWidget* to) {
    if (window()->focusWidget() == from) to->setFocus();
  };
  if (busy) {
    stop_->setVisible(true);
    passFocus(write_, stop_);
    write_->setEnabled(false);
  } else {
    write_->setEnabled(true);
    passFocus(stop_, write_);
    stop_->setVisible(false);
  }
  if (stopping_.stop_requested()) passFocus(stop_, path_);
  stop_->setEnabled(!stopping_.stop_requested());
  stop_->setText(stop_->isEnabled() ? tr("Stop") : tr("Stopping..."));
}

void ExportPage::browse() {
  const std::vector<const ExportTarget*> several = wanted();
  const ExportTarget* target = several.size() == 1 ? several.front() : chosen();
  if (!target) return;
  const QString path = several.size() > 1 ? QFileDialog::getExistingDirectory(this, tr("Write into"), path_->text())
                                          : QFileDialog::getSaveFileName(this, tr("Write to"), path_->text(),
                                                                         QStringLiteral("*") + target->extension);
  if (path.isEmpty()) return;
  if (several.size() <= 1) replaceable_ = {path};  // The dialog asks.
  path_->setText(path);
}

/// The files that are asked for, as their writing is to find them.
std::vector<ExportPage::File> ExportPage::files() const {
  const std::vector<const ExportTarget*> several = wanted();
  if (several.size() > 1) {
    std::vector<File> files;
    for (const ExportTarget* target : several)
      files.push_back({path_->text().trimmed() + QLatin1Char('/') + suggestedName(*target), target});
    return files;
  }
  const ExportTarget* target = several.empty() ? chosen() : several.front();
  if (!target) return {};
  return {{path_->text().trimmed(), target}};
}

/// What is amiss with the place to write to; empty when nothing is.
QString ExportPage::pathProblem() const {
  const QString path = path_->text().trimmed();
  if (wanted().size() > 1) return path.isEmpty() ? tr("Name the folder to write into.") : QString();
  if (path.isEmpty()) return tr("Name the file to write.");
  const bool is_folder = QFileInfo(path).isDir() || path.endsWith(QLatin1Char('/'));
  return is_folder ? tr("%1 is a folder; name a file in it.").arg(QDir::toNativeSeparators(path)) : QString();
}

void ExportPage::write() {
  if (jobs_.busy()) return;
  if (const QString problem = pathProblem(); !problem.isEmpty()) {
    workbench_.showMessage({problem, Severity::kAttention, {}, {}});
    path_->setFocus();
    return;
  }
  const std::vector<File> wanted_files = files();
  QStringList present;
  for (const File& file : wanted_files) {
    if (file.target->exporter && !workbench_.correctorCorrects()) return;
    if (file.target->id == QLatin1String("report") && !workbench_.comparisonIsCurrent()) {
      workbench_.showMessage({tr("The report shows the comparison; compare the methods first."), Severity::kAttention,
                              tr("Compare"), [this] { workbench_.goToPage(QStringLiteral("compare")); }});
      return;
    }
    if (QFileInfo::exists(file.path) && !replaceable_.contains(file.path)) present << file.path;
  }
  if (wanted_files.empty()) return;
  if (!present.isEmpty()) return askToReplace(present);
  std::vector<Writing> writings;
  ExportChoices choices{bake_->isChecked(), inverse_->isChecked(), deviation_->value() / 1000.0, {}};
  if (sensor_->count() > 0) choices.sensor = sensor_->currentData().toInt();
  for (const File& file : wanted_files) writings.push_back({file.path, file.target->prepare(choices), {}});
  progress_->setValue(0);
  stopping_ = std::stop_source();
  jobs_.run(
      [writings, stopping = stopping_](const RunControl& control) { return writeAll(writings, control, stopping); },
      [this](const Result<std::vector<Writing>>& written) { onWritten(written); },
      [this](double fraction) { progress_->setValue(static_cast<int>(fraction * kExportSteps)); });
  showBusy();
}

void ExportPage::askToReplace(const QStringList& present) {
  const QString text = present.size() == 1
                           ? tr("%1 exists already; nothing was written.").arg(QDir::toNativeSeparators(present[0]))
                           : tr("%1 of these files exist already; nothing was written.").arg(present.size());
  workbench_.showMessage(
      {text, Severity::kAttention, present.size() == 1 ? tr("Replace it") : tr("Replace them"), [this, present] {
         replaceable_ = present;
         const std::vector<File> now = files();
         const bool same = std::all_of(present.begin(), present.end(), [&](const QString& path) {
           return std::any_of(now.begin(), now.end(), [&](const File& file) { return file.path == path; });
         });
         if (same) write();
       }});
}

/// One after the other, so that a stop leaves whole files.
std::vector<ExportPage::Writing> ExportPage::writeAll(std::vector<Writing> writings, const RunControl& control,
                                                      const std::stop_source& stopping) {
  const std::stop_callback page_goes(control.stop, [&stopping] { stopping.request_stop(); });
  const double each = 1.0 / static_cast<double>(writings.size());
  for (std::size_t i = 0; i < writings.size(); ++i) {
    if (stopping.stop_requested()) {
      writings[i].result = fail(ErrorCode::kCancelled, "Stopped on request");
      continue;
    }
    RunControl part = control;
    part.stop = stopping.get_token();
    part.progress = [&control, each, i](double fraction) {
      control.progress((static_cast<double>(i) + fraction) * each);
    };
    writings[i].result = writings[i].write(writings[i].path.toStdString(), part);
    control.progress(static_cast<double>(i + 1) * each);
  }
  return writings;
}

/// Some files are written in one go: what became of all of them is told when the writing has ended.
void ExportPage::stop() {
  stopping_.request_stop();
  showBusy();
}

void ExportPage::onWritten(const Result<std::vector<Writing>>& result) {
  showBusy();
  if (!result) {
    workbench_.showMessage({QString::fromStdString(result.error().message), Severity::kDanger, {}, {}});
    return;
  }
  const std::vector<Writing>& written = *result;
  QStringList failures, notes;
  qsizetype n_stopped = 0;
  for (const Writing& file : written) {
    if (file.result) {
      if (!replaceable_.contains(file.path)) replaceable_ << file.path;
      if (!file.result->empty()) notes << QString::fromStdString(*file.result);
    } else if (file.result.error().code == ErrorCode::kCancelled) {
      ++n_stopped;
    } else {
      failures << QString::fromStdString(file.result.error().message);
    }
  }
  const QString first = written.front().path;
  const std::function<void()> open_folder = [first] {
    QDesktopServices::openUrl(QUrl::fromLocalFile(QFileInfo(first).absolutePath()));
  };
  const auto n_written = static_cast<qsizetype>(written.size()) - failures.size() - n_stopped;
  if (n_written == 0 && n_stopped == 0) {
    workbench_.showMessage({failures.join(QLatin1Char(' ')), Severity::kDanger, {}, {}});
    return;
  }
  const QString folder = QDir::toNativeSeparators(QFileInfo(first).absolutePath());
  QStringList told;
  if (n_written == 0)
    told << tr("Stopped: nothing was written");
  else if (n_stopped > 0)
    told << tr("Stopped: %1 of %2 files written to %3").arg(n_written).arg(written.size()).arg(folder);
  else if (written.size() == 1)
    told << tr("Written: %1").arg(QDir::toNativeSeparators(first)) << notes;
  else
    told << tr("%1 files written to %2").arg(n_written).arg(folder);
  if (!failures.isEmpty()) told << tr("%1 could not be: %2").arg(failures.size()).arg(failures.join(QLatin1Char(' ')));
  workbench_.showMessage({told.join(QStringLiteral(". ")), failures.isEmpty() ? Severity::kInfo : Severity::kAttention,
                          tr("Open the folder"), n_written > 0 ? open_folder : std::function<void()>()});
}

}  // namespace fieldtrue::widgets
