#include "widgets/pages/import_page.h"

#include <QComboBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QGridLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSignalBlocker>
#include <QStyle>
#include <QVBoxLayout>
#include <set>

#include "acquisition/session/imported_session.h"
#include "calib/importers/registry.h"
#include "calib/recording/unit_slip.h"
#include "widgets/forms/settings_form.h"
#include "widgets/pages/column_table.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kPreviewRows = 12;
constexpr std::size_t kNotesShown = 3;
constexpr int kImportFormWidth = 340;
constexpr int kImportMargin = 20;

const importers::Importer& columnsFormat() { return *importers::findImporter("columns").value(); }

/// Settings of the text format that name a column; the others say how the file is written.
bool namesColumn(const Setting& setting) { return setting.type == SettingType::kChoice && setting.choices.empty(); }

/// Stands for a unit that could not be told, so that nobody takes the first of the list by oversight.
constexpr const char* kNoUnit = "choose";

std::vector<Setting> settingsOf(const importers::Importer& importer, bool of_columns) {
  std::vector<Setting> some;
  for (const Setting& setting : importer.settings)
    if ((&importer == &columnsFormat() && namesColumn(setting)) == of_columns) some.push_back(setting);
  return some;
}

QString text(const std::string& words) { return QString::fromStdString(words); }

QString lines(const std::vector<std::string>& sentences, std::size_t most) {
  QStringList shown;
  for (std::size_t i = 0; i < std::min(sentences.size(), most); ++i) shown << text(sentences[i]);
  if (sentences.size() > most) shown << ImportPage::tr("and %1 notes more").arg(sentences.size() - most);
  return shown.join(QLatin1Char('\n'));
}

}  // namespace

ImportPage::ImportPage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(kImportMargin, kImportMargin, kImportMargin, kImportMargin);
  layout->setSpacing(12);
  auto* title = new QLabel(tr("Import"), this);
  title->setProperty("role", "title");
  auto* about =
      new QLabel(tr("Another program's recording becomes a session, its calibration one to hold ours against. "
                    "A file may be dropped anywhere on the window."),
                 this);
  about->setProperty("role", "muted");
  about->setWordWrap(true);
  auto* grid = new QGridLayout;
  grid->setColumnStretch(1, 1);
  file_ = addFileRow(grid, 0, tr("File"), "importFile", &ImportPage::chooseFile);
  format_ = new QComboBox(this);
  format_->setObjectName(QStringLiteral("importFormat"));
  format_->setAccessibleName(tr("Format of the file"));
  grid->addWidget(new QLabel(tr("Format"), this), 1, 0);
  grid->addWidget(format_, 1, 1);
  truth_ = addFileRow(grid, 2, tr("True positions"), "importTruth", &ImportPage::chooseTruth);
  truth_->setPlaceholderText(tr("only if they stand in a file of their own"));
  truth_label_ = static_cast<QLabel*>(grid->itemAtPosition(2, 0)->widget());
  truth_button_ = static_cast<QPushButton*>(grid->itemAtPosition(2, 2)->widget());
  columns_ = new ColumnTable(this);
  columns_->setObjectName(QStringLiteral("importColumns"));
  form_ = new SettingsForm(this);
  form_->setMaximumWidth(kImportFormWidth);
  auto* middle = new QHBoxLayout;
  middle->setSpacing(kImportMargin);
  middle->addWidget(columns_, 1);
  middle->addWidget(form_, 0, Qt::AlignTop);
  guess_ = new QLabel(this);
  guess_->setObjectName(QStringLiteral("importGuess"));
  guess_->setProperty("role", "muted");
  summary_ = new QLabel(this);
  summary_->setObjectName(QStringLiteral("importSummary"));
  for (QLabel* label : {guess_, summary_}) {
    label->setWordWrap(true);
    label->setTextInteractionFlags(Qt::TextSelectableByMouse);
  }
  auto* last = new QGridLayout;
  last->setColumnStretch(1, 1);
  target_ = addFileRow(last, 0, tr("Session"), "importTarget", &ImportPage::chooseTarget);
  target_label_ = static_cast<QLabel*>(last->itemAtPosition(0, 0)->widget());
  make_ = new QPushButton(this);
  make_->setObjectName(QStringLiteral("importMake"));
  make_->setProperty("primary", true);
  last->addWidget(make_, 0, 3);
  layout->addWidget(title);
  layout->addWidget(about);
  layout->addLayout(grid);
  layout->addLayout(middle, 1);
  layout->addWidget(guess_);
  layout->addWidget(summary_);
  layout->addStretch();
  layout->addLayout(last);
  fillFormats();

  connect(file_, &QLineEdit::editingFinished, this, [this] {
    if (file_->isModified()) setFile(file_->text());
  });
  connect(format_, &QComboBox::activated, this, [this](int row) { look(row); });
  connect(truth_, &QLineEdit::editingFinished, this, &ImportPage::read);
  connect(columns_, &ColumnTable::changed, this, &ImportPage::read);
  connect(form_, &SettingsForm::changed, this, &ImportPage::onHowItIsWritten);
  connect(make_, &QPushButton::clicked, this, &ImportPage::make);
  connect(&workbench_, &Workbench::importRequested, this, &ImportPage::setFile);
  showFormat({});
}

QLineEdit* ImportPage::addFileRow(QGridLayout* grid, int row, const QString& label, const char* name,
                                  void (ImportPage::*choose)()) {
  auto* path = new QLineEdit(this);
  path->setObjectName(QLatin1String(name));
  path->setAccessibleName(label);
  auto* button = new QPushButton(tr("Choose..."), this);
  grid->addWidget(new QLabel(label, this), row, 0);
  grid->addWidget(path, row, 1);
  grid->addWidget(button, row, 2);
  connect(button, &QPushButton::clicked, this, choose);
  return path;
}

void ImportPage::fillFormats() {
  for (const importers::Importer& importer : importers::importers()) {
    formats_.push_back({&importer, nullptr});
    format_->addItem(tr("Recording: %1").arg(text(importer.label)));
  }
  for (const exporters::CalibrationFormat& calibration : exporters::calibrationFormats()) {
    formats_.push_back({nullptr, &calibration});
    format_->addItem(tr("Calibration: %1").arg(text(calibration.label)));
  }
}

const ImportPage::Format& ImportPage::format() const {
  return formats_[static_cast<std::size_t>(std::max(0, format_->currentIndex()))];
}

bool ImportPage::readsColumns() const { return format().recording == &columnsFormat(); }

Settings ImportPage::settings() const {
  Settings all = form_->values();
  if (readsColumns()) all.merge(columns_->values());
  return all;
}

void ImportPage::chooseFile() {
  const QString path = QFileDialog::getOpenFileName(this, tr("Choose a file to import"), Workbench::sessionFolder());
  if (!path.isEmpty()) setFile(path);
}

void ImportPage::chooseTruth() {
  const QString path = QFileDialog::getOpenFileName(this, tr("Choose the file with the true positions"),
                                                    QFileInfo(file_->text()).absolutePath());
  if (path.isEmpty()) return;
  truth_->setText(path);
  read();
}

void ImportPage::chooseTarget() {
  const QString path = QFileDialog::getSaveFileName(this, tr("Write to"), target_->text());
  if (!path.isEmpty()) target_->setText(path);
}

void ImportPage::setFile(const QString& path) {
  const bool is_session = path.endsWith(QStringLiteral(".fieldtrue"), Qt::CaseInsensitive);
  file_->setText(is_session ? QString() : path);
  file_->setModified(false);
  truth_->clear();
  look({});
  if (!is_session) return;
  if (workbench_.sessionIsOpen() && QFileInfo(path) == QFileInfo(workbench_.sessionPath()))
    return tell(tr("%1 is the session that is open; choose another program's file.").arg(QFileInfo(path).fileName()),
                true);
  workbench_.openSession(path);
}

/// Finds the format where none is given, and of a table of text what its columns are.
void ImportPage::look(std::optional<int> chosen) {
  looking_.stop();
  reading_.stop();
  read_ = {};
  showMake();
  if (file_->text().isEmpty()) return showFormat({});
  tell(tr("Reading %1 ...").arg(QFileInfo(file_->text()).fileName()), false);
  looking_.run(
      [path = std::filesystem::path(file_->text().toStdString()), chosen,
       formats = formats_](const RunControl&) -> Result<Look> {
        Look found;
        const auto rowOf = [&](const auto& is) {
          return static_cast<int>(std::find_if(formats.begin(), formats.end(), is) - formats.begin());
        };
        const auto is_columns = [](const Format& one) { return one.recording == &columnsFormat(); };
        if (chosen) {
          found.format = *chosen;
        } else if (const auto* recording = importers::recogniseRecording(path)) {
          found.format = rowOf([&](const Format& one) { return one.recording == recording; });
        } else if (const auto* calibration = exporters::recogniseCalibration(path)) {
          found.format = rowOf([&](const Format& one) { return one.calibration == calibration; });
        } else {
          found.format = rowOf(is_columns);
        }
        if (!is_columns(formats[static_cast<std::size_t>(found.format)])) return found;
        FT_TRY(found.guess, importers::guessColumns(path));
        FT_TRY(found.preview, importers::previewText(path, found.guess->settings, kPreviewRows));
        return found;
      },
      [this](Result<Look> found) { onLook(std::move(found)); });
}

void ImportPage::onLook(Result<Look> found) {
  if (!found) {
    showFormat({format_->currentIndex(), {}, {}});
    tell(text(found.error().message), true);
    return;
  }
  format_->setCurrentIndex(found->format);
  showFormat(*found);
  read();
}

void ImportPage::showFormat(const Look& found) {
  const bool is_recording = format().recording != nullptr;
  columns_->setVisible(found.preview.has_value());
  guess_->setText(found.guess ? lines(found.guess->reasons, found.guess->reasons.size()) : QString());
  guess_->setVisible(found.guess.has_value());
  const QSignalBlocker quiet_form(form_);
  Settings written = found.guess ? found.guess->settings : Settings();
  std::vector<Setting> declared = is_recording ? settingsOf(*format().recording, false) : std::vector<Setting>();
  if (found.guess && !found.guess->has_unit) {
    written["unit"] = std::string(kNoUnit);
    for (Setting& setting : declared)
      if (setting.key == "unit") setting.choices.insert(setting.choices.begin(), kNoUnit);
  }
  form_->setSettings(declared, written);
  if (found.preview) {
    const QSignalBlocker quiet_columns(columns_);
    columns_->setTable(*found.preview, settingsOf(columnsFormat(), true), found.guess->settings);
  }
  form_->setVisible(form_->isVisibleTo(this) && !file_->text().isEmpty());
  const bool may_have_truth = is_recording && !file_->text().isEmpty() && format().recording->id != "nodes";
  for (QWidget* part : std::initializer_list<QWidget*>{truth_label_, truth_, truth_button_})
    part->setVisible(may_have_truth);
  target_label_->setText(is_recording ? tr("Session") : tr("Calibration"));
  make_->setText(is_recording ? tr("Make the session") : tr("Write the calibration"));
  showMake();
  target_->setText(suggestedTarget());
  if (file_->text().isEmpty()) tell(tr("Choose a file, or drop one here."), false);
}

/// Another separator or header gives other columns.
void ImportPage::onHowItIsWritten() {
  if (!readsColumns()) return read();
  const Settings now = settings();
  const Result<importers::TextPreview> preview = importers::previewText(file_->text().toStdString(), now, kPreviewRows);
  if (!preview) {
    reading_.stop();
    read_ = {};
    showMake();
    return tell(text(preview.error().message), true);
  }
  const QSignalBlocker quiet(columns_);
  columns_->setTable(*preview, settingsOf(columnsFormat(), true), now);
  read();
}

void ImportPage::read() {
  reading_.stop();
  read_ = {};
  showMake();
  if (file_->text().isEmpty()) return;
  if (readsColumns() && choiceSetting(settings(), "unit") == kNoUnit)
    return tell(tr("Choose the unit of the positions."), true);
  const std::filesystem::path path = file_->text().toStdString();
  std::optional<std::filesystem::path> truth;
  if (truth_->isVisibleTo(this) && !truth_->text().isEmpty()) truth = truth_->text().toStdString();
  reading_.run(
      [format = format(), path, truth, settings = settings()](const RunControl&) -> Result<Read> {
        Read result;
        if (format.calibration) {
          FT_TRY(result.calibration, exporters::importCalibration(*format.calibration, path));
          return result;
        }
        if (format.recording->needs_truth && !truth)
          return fail(ErrorCode::kBadInput, "This format holds no true positions: choose the file that does.");
        FT_TRY(result.recording, format.recording->read(path, truth, settings));
        return result;
      },
      [this](Result<Read> result) { onRead(std::move(result)); });
}

void ImportPage::onRead(Result<Read> result) {
  if (!result) return tell(text(result.error().message), true);
  read_ = *std::move(result);
  showMake();
  if (read_.recording) return showRecording(*read_.recording);
  tell(lines(read_.calibration->report().notes, kNotesShown), false);
}

void ImportPage::showRecording(const importers::Import& recording) {
  if (!recording.table)
    return tell(tr("There are no true positions, and so nothing to fit: name the columns that hold them, or choose a "
                   "file that does."),
                true);
  std::set<int> places;
  Eigen::AlignedBox3d box;
  for (const Node& node : recording.table->nodes) {
    places.insert(node.node);
    box.extend(node.reference_from_sensor.position_m);
  }
  const QString rows =
      tr("%1 places in %2 rows, %3. The true places span %4 x %5 x %6.")
          .arg(places.size())
          .arg(recording.table->nodes.size())
          .arg(recording.samples ? tr("%1 samples").arg(recording.samples->rows.size()) : tr("means only"))
          .arg(coordinateText(box.sizes().x()), coordinateText(box.sizes().y()), coordinateText(box.sizes().z()));
  const Result<void> units = recording::checkUnits(*recording.table);
  const QString notes = lines(recording.notes, kNotesShown);
  tell(rows + (units ? QString() : QLatin1Char('\n') + text(units.error().message)) +
           (notes.isEmpty() ? QString() : QLatin1Char('\n') + notes),
       !units);
}

void ImportPage::tell(const QString& summary, bool is_attention) {
  summary_->setText(summary);
  summary_->setProperty("role", is_attention ? "attention" : "");
  summary_->style()->unpolish(summary_);
  summary_->style()->polish(summary_);
}

QString ImportPage::suggestedTarget() const {
  const QFileInfo file(file_->text());
  if (file_->text().isEmpty()) return {};
  const QString stem = file.fileName().section(QLatin1Char('.'), 0, 0);
  if (format().recording) return Workbench::freshSessionPath(stem);
  return file.absolutePath() + QLatin1Char('/') + stem + QStringLiteral(".ftcal.json");
}

/// Whether something was read that a file can be made of.
bool ImportPage::canMake() const { return (read_.recording && read_.recording->table) || read_.calibration; }

void ImportPage::showMake() { make_->setEnabled(canMake() && !making_.busy()); }

void ImportPage::make() {
  const QString path = target_->text();
  if (path.isEmpty() || !canMake() || making_.busy()) return;
  if (QFileInfo::exists(path)) {
    workbench_.showMessage(
        {tr("%1 exists already; nothing was written. Choose another name.").arg(path), Severity::kAttention, {}, {}});
    return;
  }
  if (read_.recording)
    makeSession(path);
  else
    writeCalibration(path);
  showMake();
}

void ImportPage::makeSession(const QString& path) {
  making_.run(
      [path, recording = *read_.recording, source = file_->text().toStdString()](const RunControl&) {
        return acquisition::makeSession(path, *recording.table, recording.samples, source);
      },
      [this, path](const Result<void>& made) {
        showMake();
        if (!made) {
          workbench_.showMessage({text(made.error().message), Severity::kDanger, {}, {}});
          return;
        }
        target_->setText(suggestedTarget());
        workbench_.openSession(path);
      });
}

void ImportPage::writeCalibration(const QString& path) {
  making_.run([path, calibration = *read_.calibration](
                  const RunControl&) -> Result<void> { return calibration.save(path.toStdString()); },
              [this, path](const Result<void>& written) {
                showMake();
                if (!written) {
                  workbench_.showMessage({text(written.error().message), Severity::kDanger, {}, {}});
                  return;
                }
                workbench_.showMessage({tr("Written: %1").arg(path), Severity::kInfo, tr("Hold it against another"),
                                        [this, path] { workbench_.compareWith(path); }});
              });
}

}  // namespace fieldtrue::widgets
