#include "widgets/pages/export_page.h"

#include <QCheckBox>
#include <QDateTime>
#include <QDesktopServices>
#include <QDir>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QStackedWidget>
#include <QUrl>
#include <QVBoxLayout>

#include "calib/core/setup.h"
#include "calib/core/thread_pool.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "widgets/compare/method_list.h"
#include "widgets/forms/empty_page.h"
#include "widgets/forms/number_box.h"
#include "widgets/report/report.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/draw_picture.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/compared_methods.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kExportColumnWidth = 720;
constexpr int kRowHeight = 36;
constexpr int kMostRows = 12;
constexpr int kGap = 24;
constexpr double kLeastDeviation_mm = 0.001;
constexpr double kUsualDeviation_mm = 0.05;
constexpr double kMostDeviation_mm = 10.0;

/// Heading of the formats for one purpose.
QString sectionOf(exporters::Purpose purpose) {
  switch (purpose) {
    case exporters::Purpose::kFieldtrue:
      return ExportPage::tr("For Fieldtrue");
    case exporters::Purpose::kSlicer:
      return ExportPage::tr("For 3D Slicer and ITK");
    case exporters::Purpose::kParaView:
      return ExportPage::tr("For ParaView and VTK");
    case exporters::Purpose::kVrui:
      return ExportPage::tr("For Vrui");
    case exporters::Purpose::kNumbers:
      return ExportPage::tr("For Python, MATLAB and spreadsheets");
    case exporters::Purpose::kProgram:
      return ExportPage::tr("For a program of your own");
    case exporters::Purpose::kPeriod:
      return ExportPage::tr("For CAVE software of its time");
    case exporters::Purpose::kRigid:
      return ExportPage::tr("For PLUS and VRPN: the rigid part");
  }
  return {};
}

Result<std::string> said(const Result<void>& written, const std::string& note = {}) {
  if (!written) return tl::unexpected(written.error());
  return note;
}

}  // namespace

ExportPage::ExportPage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  fillTargets();
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
  auto* row = new QHBoxLayout;
  row->addWidget(path_, 1);
  row->addWidget(browse_button);
  row->addWidget(write_);
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
    const Target& target = targets_[at];
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
    items_.push_back(item);
  }
}

QWidget* ExportPage::makeBake() {
  bake_row_ = new QWidget(this);
  pitch_ = new QLabel(tr("The lattice is off the method by at most"), bake_row_);
  inverse_ = new QCheckBox(tr("True to measured, for programs that resample"), bake_row_);
  inverse_->setObjectName(QStringLiteral("exportInverse"));
  connect(inverse_, &QCheckBox::toggled, this, &ExportPage::onDirection);
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

ExportPage::Writing ExportPage::calibrationWriter(const exporters::Exporter& exporter) const {
  const bool bake = exporter.knows_pose && bake_->isChecked() && !workbench_.corrector()->isBaked();
  const double deviation_m = deviation_->value() / 1000.0;
  exporters::ExportOptions options;
  options.name = QFileInfo(workbench_.sessionPath()).completeBaseName().toStdString();
  options.mean_orientation = true;
  options.held_out = heldOutError();
  if (exporter.has_free_pitch) options.max_deviation_m = deviation_m;
  if (exporter.may_be_inverse && inverse_->isChecked()) options.direction = exporters::Direction::kTrueToMeasured;
  return [corrector = *workbench_.corrector(), exporter = &exporter, bake, deviation_m,
          options](const std::string& path) -> Result<std::string> {
    RunControl control;
    control.parallel_for = threadedFor(0);
    const Result<calibration::Corrector> written =
        bake ? corrector.baked(deviation_m, control) : Result<calibration::Corrector>(corrector);
    if (!written) return tl::unexpected(written.error());
    FT_TRY(const auto done, exporters::exportCalibration(*exporter, *written, options, path, control));
    std::string note = bake ? written->report().notes.back() : std::string();
    for (const std::string& one : done.notes) note += (note.empty() ? "" : " ") + one;
    return note;
  };
}

/// Of the method that is written, if the comparison on screen judged it.
std::optional<exporters::HeldOutError> ExportPage::heldOutError() const {
  if (!workbench_.comparison() || !workbench_.correctorIsCurrent()) return std::nullopt;
  const calibration::CorrectorChoice& choice = workbench_.corrector()->choice();
  for (const evaluation::MethodScore& score : workbench_.comparison()->position)
    if (score.method == choice.position_id && score.settings == choice.position_settings && !score.skipped)
      return exporters::HeldOutError{score.stats.rms / 1000.0, toText(workbench_.comparison()->validation)};
  return std::nullopt;
}

void ExportPage::fillTargets() {
  for (const exporters::Exporter& exporter : exporters::exporters())
    targets_.push_back({QString::fromStdString(exporter.id), QString::fromStdString(exporter.label),
                        QString::fromStdString(exporter.extension),
                        tr("For %1. In the file: %2.")
                            .arg(QString::fromStdString(exporter.reads_it), QString::fromStdString(exporter.in_words)),
                        sectionOf(exporter.purpose), &exporter,
                        [this, &exporter] { return calibrationWriter(exporter); }});
  targets_.push_back({QStringLiteral("nodes"), tr("Node table"), QStringLiteral(".nodes.csv"),
                      tr("One row per place: what the rig says and what the tracker said."), tr("Recording and report"),
                      nullptr, [this] {
                        return [table = workbench_.recordedTable()](const std::string& path) {
                          return said(writeNodeTable(std::filesystem::path(path), table));
                        };
                      }});
  targets_.push_back({QStringLiteral("samples"), tr("Raw samples"), QStringLiteral(".samples.csv"),
                      tr("Every reading that was taken at the places."), tr("Recording and report"), nullptr, [this] {
                        return [samples = workbench_.samples()](const std::string& path) {
                          return said(writeSampleTable(std::filesystem::path(path), samples));
                        };
                      }});
  targets_.push_back(
      {QStringLiteral("report"), tr("Report"), QStringLiteral(".html"),
       tr("One page with pictures, the method table, the verdict and where it all came from; any browser."),
       tr("Recording and report"), nullptr, [this] {
         return [input = reportInput()](const std::string& path) { return said(writeHtmlReport(input, path)); };
       }});
}

ReportInput ExportPage::reportInput() const {
  ReportInput input;
  input.draw = drawPictures;
  input.table = workbench_.table();
  if (workbench_.comparison()) input.comparison = *workbench_.comparison();
  input.gap = workbench_.gapReport();
  input.source = workbench_.sessionPath().toStdString();
  input.plan = toJson(workbench_.plan()).dump();
  input.places = workbench_.status().session->places;
  input.states = workbench_.status().recorded->states;
  if (!workbench_.comparisonIsFinal()) {
    const Workbench::MethodCount count = workbench_.comparedMethods();
    input.notes.push_back("The comparison tells " + std::to_string(count.done) + " of " + std::to_string(count.wanted) +
                          " methods that were asked for: it was not finished.");
  }
  input.made_at = QDateTime::currentDateTime().toString(Qt::ISODate).toStdString();
  return input;
}

void ExportPage::onData() {
  const bool has_something = workbench_.corrector() || !workbench_.recordedTable().nodes.empty();
  stack_->setCurrentIndex(has_something ? 1 : 0);
  if (!has_something) return;
  showCalibration();
  onTarget();
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
        tr("Calibration: %1 for position, %2 for orientation, fitted on %3 rows.%4%5 Set-up: %6.")
            .arg(methodLabel(MethodPart::kPosition, choice.position_id, choice.position_settings),
                 methodLabel(MethodPart::kOrientation, choice.orientation_id, choice.orientation_settings))
            .arg(workbench_.corrector()->report().n_nodes)
            .arg(warning, verdictOnCalibration(), setupOfCalibration()));
  } else {
    calibration_->setText(
        tr("The calibration kept in this session corrects nothing, neither position nor orientation: "
           "it cannot be written. Fit a method on the compare page."));
  }
  for (std::size_t row = 0; row < targets_.size(); ++row) {
    QListWidgetItem* item = items_[row];
    const bool offered = corrects || !targets_[row].exporter;
    item->setFlags(offered ? item->flags() | Qt::ItemIsEnabled : item->flags() & ~Qt::ItemIsEnabled);
    if (offered && (!chosen() || !(list_->currentItem()->flags() & Qt::ItemIsEnabled))) list_->setCurrentItem(item);
  }
}

const ExportPage::Target* ExportPage::chosen() const {
  const QListWidgetItem* item = list_->currentItem();
  if (item == nullptr || !item->data(Qt::UserRole).isValid()) return nullptr;
  return &targets_[static_cast<std::size_t>(item->data(Qt::UserRole).toInt())];
}

QString ExportPage::suggestedPath(const Target& target) const {
  const QFileInfo session(workbench_.sessionPath());
  QString name = session.completeBaseName();
  if (target.exporter && target.exporter->purpose != exporters::Purpose::kFieldtrue && !target.exporter->knows_pose)
    name += inverse_->isVisibleTo(bake_row_) && inverse_->isChecked() ? QStringLiteral("_true-to-measured")
                                                                      : QStringLiteral("_measured-to-true");
  return session.absolutePath() + QLatin1Char('/') + name + target.extension;
}

void ExportPage::onTarget() {
  const Target* target = chosen();
  if (!target) return;
  about_->setText(target->reads_it);
  const exporters::Exporter* exporter = target->exporter;
  const bool is_lattice = exporter && exporter->has_free_pitch;
  const bool can_be_baked = exporter && exporter->knows_pose;
  bake_row_->setVisible(is_lattice || can_be_baked || (exporter && exporter->may_be_inverse));
  bake_->setVisible(can_be_baked);
  bake_->setEnabled(workbench_.corrector() && !workbench_.corrector()->isBaked());
  pitch_->setVisible(is_lattice);
  deviation_->setVisible(is_lattice || can_be_baked);
  deviation_->setEnabled(is_lattice || (can_be_baked && bake_->isEnabled() && bake_->isChecked()));
  inverse_->setVisible(exporter && exporter->may_be_inverse);
  path_->setText(suggestedPath(*target));
}

void ExportPage::onDirection() {
  if (const Target* target = chosen()) path_->setText(suggestedPath(*target));
}

void ExportPage::browse() {
  const Target* target = chosen();
  if (!target) return;
  const QString path =
      QFileDialog::getSaveFileName(this, tr("Write to"), path_->text(), QStringLiteral("*") + target->extension);
  if (path.isEmpty()) return;
  replaceable_ = path;  // The dialog asks.
  path_->setText(path);
}

void ExportPage::write() {
  const Target* target = chosen();
  const QString path = path_->text();
  if (!target || path.isEmpty()) return;
  if (target->exporter && !workbench_.correctorCorrects()) return;
  if (target->id == QLatin1String("report") && !workbench_.comparisonIsCurrent()) {
    workbench_.showMessage({tr("The report shows the comparison; compare the methods first."), Severity::kAttention,
                            tr("Compare"), [this] { workbench_.goToPage(QStringLiteral("compare")); }});
    return;
  }
  if (QFileInfo::exists(path) && path != replaceable_) {
    workbench_.showMessage({tr("%1 exists already; nothing was written.").arg(QDir::toNativeSeparators(path)),
                            Severity::kAttention, tr("Replace it"), [this, path] {
                              replaceable_ = path;
                              if (path_->text() == path) write();
                            }});
    return;
  }
  write_->setEnabled(false);
  runInBackground(
      this, [work = target->prepare(), path] { return work(path.toStdString()); },
      [this, path](const Result<std::string>& written) { onWritten(path, written); });
}

void ExportPage::onWritten(const QString& path, const Result<std::string>& written) {
  write_->setEnabled(true);
  if (written) {
    replaceable_ = path;
    const QString note = QString::fromStdString(*written);
    workbench_.showMessage({tr("Written: %1").arg(QDir::toNativeSeparators(path)) +
                                (note.isEmpty() ? QString() : QStringLiteral(". ") + note),
                            Severity::kInfo, tr("Open the folder"), [path] {
                              QDesktopServices::openUrl(QUrl::fromLocalFile(QFileInfo(path).absolutePath()));
                            }});
  } else {
    workbench_.showMessage({QString::fromStdString(written.error().message), Severity::kDanger, {}, {}});
  }
}

}  // namespace fieldtrue::widgets
