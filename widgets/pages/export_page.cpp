#include "widgets/pages/export_page.h"

#include <QDateTime>
#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QStackedWidget>
#include <QVBoxLayout>

#include "calib/core/table_io.h"
#include "calib/exporters/registry.h"
#include "widgets/pages/background.h"
#include "widgets/pages/empty_page.h"
#include "widgets/pages/units.h"
#include "widgets/report/report.h"

namespace fieldtrue {
namespace {

constexpr int kColumnWidth = 720;
constexpr int kRowHeight = 36;

}  // namespace

ExportPage::ExportPage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  fillTargets();
  auto* content = new QWidget(this);
  auto* outer = new QHBoxLayout(content);
  auto* column = new QWidget(content);
  column->setMaximumWidth(kColumnWidth);
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
  list_->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Fixed);
  layout->addWidget(list_);
  layout->addWidget(about_);
  layout->addLayout(row);
  layout->addStretch(1);
  outer->addStretch();
  outer->addWidget(column, 1);
  outer->addStretch();

  stack_ = new QStackedWidget(this);
  stack_->addWidget(new EmptyPage(tr("There is no calibration to export yet."),
                                  tr("Compare the methods and fit the one you choose."),
                                  {{tr("Compare"), [this] { workbench_.goToStep(Step::kCompare); }}}, this));
  stack_->addWidget(content);
  auto* page = new QVBoxLayout(this);
  page->setContentsMargins(0, 0, 0, 0);
  page->addWidget(stack_);

  for (const Target& target : targets_) {
    auto* item = new QListWidgetItem(QStringLiteral("%1   (%2)").arg(target.label, target.extension), list_);
    item->setSizeHint(QSize(0, kRowHeight));
  }
  list_->setFixedHeight(static_cast<int>(targets_.size()) * kRowHeight + 4);
  connect(list_, &QListWidget::currentRowChanged, this, &ExportPage::onTarget);
  connect(browse_button, &QPushButton::clicked, this, &ExportPage::browse);
  connect(write_, &QPushButton::clicked, this, &ExportPage::write);
  connect(&workbench_, &Workbench::correctorChanged, this, &ExportPage::onData);
  connect(&workbench_, &Workbench::sessionChanged, this, &ExportPage::onData);
  connect(&workbench_, &Workbench::tableChanged, this, &ExportPage::onData);
  list_->setCurrentRow(0);
  onData();
}

void ExportPage::fillTargets() {
  for (const Exporter& exporter : exporters()) {
    targets_.push_back({QString::fromStdString(exporter.id), QString::fromStdString(exporter.label),
                        QString::fromStdString(exporter.extension), QString::fromStdString(exporter.reads_it),
                        [this, write = exporter.write] {
                          return [corrector = *workbench_.corrector(), write](const std::string& path) {
                            return write(corrector, path);
                          };
                        }});
  }
  targets_.push_back({QStringLiteral("nodes"), tr("Node table"), QStringLiteral(".nodes.csv"),
                      tr("One row per place: what the rig says and what the tracker said."), [this] {
                        return [table = workbench_.table()](const std::string& path) {
                          return writeNodeTable(std::filesystem::path(path), table);
                        };
                      }});
  targets_.push_back({QStringLiteral("samples"), tr("Raw samples"), QStringLiteral(".samples.csv"),
                      tr("Every reading that was taken at the places."), [this] {
                        return [samples = workbench_.samples()](const std::string& path) {
                          return writeSampleTable(std::filesystem::path(path), samples);
                        };
                      }});
  targets_.push_back(
      {QStringLiteral("report"), tr("Report"), QStringLiteral(".html"),
       tr("One page with pictures, the method table, the verdict and where it all came from; any browser."),
       [this] { return [input = reportInput()](const std::string& path) { return writeHtmlReport(input, path); }; }});
}

ReportInput ExportPage::reportInput() const {
  ReportInput input;
  input.table = workbench_.table();
  if (workbench_.comparison()) input.comparison = *workbench_.comparison();
  input.source = workbench_.sessionPath().toStdString();
  input.plan = toJson(workbench_.plan()).dump();
  input.places = workbench_.status().places;
  input.states = workbench_.status().states;
  input.made_at = QDateTime::currentDateTime().toString(Qt::ISODate).toStdString();
  return input;
}

void ExportPage::onData() {
  const std::optional<Corrector>& corrector = workbench_.corrector();
  stack_->setCurrentIndex(corrector ? 1 : 0);
  if (!corrector) return;
  const QString warning =
      workbench_.correctorIsCurrent()
          ? QString()
          : tr(" It was fitted before the session's places changed: fit again on the compare page.");
  const CorrectorChoice& choice = corrector->choice();
  calibration_->setText(
      tr("Calibration: %1 for position, %2 for orientation, fitted on %3 rows.%4")
          .arg(QString::fromStdString(choice.position_id), QString::fromStdString(choice.orientation_id))
          .arg(corrector->report().n_nodes)
          .arg(warning));
  onTarget();
}

const ExportPage::Target* ExportPage::chosen() const {
  const int row = list_->currentRow();
  return row < 0 ? nullptr : &targets_[static_cast<std::size_t>(row)];
}

QString ExportPage::suggestedPath(const Target& target) const {
  const QFileInfo session(workbench_.sessionPath());
  return session.absolutePath() + QLatin1Char('/') + session.completeBaseName() + target.extension;
}

void ExportPage::onTarget() {
  const Target* target = chosen();
  if (!target) return;
  about_->setText(target->reads_it);
  path_->setText(suggestedPath(*target));
}

void ExportPage::browse() {
  const Target* target = chosen();
  if (!target) return;
  const QString path =
      QFileDialog::getSaveFileName(this, tr("Write to"), path_->text(), QStringLiteral("*") + target->extension);
  if (!path.isEmpty()) path_->setText(path);
}

void ExportPage::write() {
  const Target* target = chosen();
  const QString path = path_->text();
  if (!target || path.isEmpty()) return;
  if (target->id == QLatin1String("report") && !workbench_.comparison()) {
    workbench_.showMessage({tr("The report shows the comparison; compare the methods first."), Severity::kAttention,
                            tr("Compare"), [this] { workbench_.goToStep(Step::kCompare); }});
    return;
  }
  write_->setEnabled(false);
  runInBackground(
      this, [work = target->prepare(), path] { return work(path.toStdString()); },
      [this, path](const Result<void>& written) { onWritten(path, written); });
}

void ExportPage::onWritten(const QString& path, const Result<void>& written) {
  write_->setEnabled(true);
  if (written) {
    workbench_.showMessage({tr("Written: %1").arg(QDir::toNativeSeparators(path)), Severity::kInfo, {}, {}});
  } else {
    workbench_.showMessage({QString::fromStdString(written.error().message), Severity::kDanger, {}, {}});
  }
}

}  // namespace fieldtrue
