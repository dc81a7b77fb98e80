#include "widgets/pages/connect_page.h"

#include <QComboBox>
#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QSettings>
#include <QVBoxLayout>
#include <algorithm>

#include "acquisition/devices/registry.h"
#include "calib/core/setup.h"
#include "widgets/forms/recorded_sensors.h"
#include "widgets/forms/settings_form.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kColumnWidth = 640;
constexpr QLatin1String kDemonstrationScene("steel_floor");

QString sceneTitle(const QString& file_stem) {
  QString title = file_stem;
  title.replace(QLatin1Char('_'), QLatin1Char(' '));
  return title;
}

// `key=value,...` of the settings that differ from their defaults.
QString changedSettings(std::span<const Setting> declared, const Settings& values) {
  QStringList parts;
  for (const Setting& setting : declared) {
    const SettingValue& value = values.at(setting.key);
    if (value == setting.default_value) continue;
    parts << QString::fromStdString(setting.key + "=" + textOf(value));
  }
  return parts.join(QLatin1Char(','));
}

/// Whether a tracker is connected, or is being connected.
bool isInUse(const acquisition::AcquisitionStatus& status) {
  return status.device == acquisition::DeviceState::kRunning ||
         status.device == acquisition::DeviceState::kConnecting || status.reconnecting;
}

}  // namespace

ConnectPage::ConnectPage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  auto* outer = new QHBoxLayout(this);
  auto* column = new QWidget(this);
  column->setMaximumWidth(kColumnWidth);
  auto* layout = new QVBoxLayout(column);
  layout->setSpacing(12);
  auto* title = new QLabel(tr("Connect a tracker"), column);
  title->setProperty("role", "title");

  kind_ = new QComboBox(column);
  kind_->setObjectName(QStringLiteral("deviceKind"));
  kind_->setAccessibleName(tr("Tracker"));
  for (const acquisition::DeviceKind& kind : acquisition::deviceKinds())
    kind_->addItem(QString::fromStdString(kind.label), QString::fromStdString(kind.id));
  kind_help_ = new QLabel(column);
  kind_help_->setProperty("role", "muted");
  kind_help_->setWordWrap(true);
  address_ = new QComboBox(column);
  address_->setObjectName(QStringLiteral("deviceAddress"));
  address_->setEditable(true);
  address_->setAccessibleName(tr("Line"));
  refresh_ = new QPushButton(tr("Look again"), column);
  auto* address_row = new QHBoxLayout;
  address_row->addWidget(address_, 1);
  address_row->addWidget(refresh_);
  address_label_ = new QLabel(tr("Line"), column);
  scene_label_ = new QLabel(tr("Room"), column);
  scene_ = new QComboBox(column);
  scene_->setAccessibleName(tr("Simulated room"));
  for (const QFileInfo& file : QDir(QStringLiteral(":/scenes")).entryInfoList())
    scene_->addItem(sceneTitle(file.fileName().section(QLatin1Char('.'), 0, 0)),
                    file.fileName().section(QLatin1Char('.'), 0, 0));
  scene_->setObjectName(QStringLiteral("deviceScene"));
  scene_->setCurrentIndex(std::max(0, scene_->findData(QString(kDemonstrationScene))));
  scene_->addItem(tr("Another scene file..."), QString());
  settings_ = new SettingsForm(column);
  setup_label_ = new QLabel(tr("This set-up"), column);
  setup_ = makeSetup();

  makeFinder();
  auto* kind_row = new QHBoxLayout;
  kind_row->addWidget(kind_, 1);
  kind_row->addWidget(find_);

  auto* form = new QFormLayout;
  form->addRow(tr("Tracker"), kind_row);
  form->addRow(QString(), found_);
  form->addRow(QString(), kind_help_);
  form->addRow(address_label_, address_row);
  form->addRow(scene_label_, scene_);
  form->addRow(tr("Settings"), settings_);
  form->addRow(setup_label_, setup_);

  connect_ = new QPushButton(tr("Connect"), column);
  connect_->setObjectName(QStringLiteral("connectButton"));
  connect_->setProperty("primary", true);
  next_ = new QPushButton(tr("Go on to the plan"), column);
  save_ = new QPushButton(tr("Save the line's bytes"), column);
  save_->setObjectName(QStringLiteral("saveTrace"));
  save_->setToolTip(
      tr("Writes the last 16 MiB that went over the tracker's line, with settings and versions, into a *.trace.zip "
         "beside the session. It can be played again: whoever looks for a fault sees what happened here."));
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(connect_);
  buttons->addWidget(next_);
  buttons->addStretch();
  buttons->addWidget(save_);
  state_ = new QLabel(column);
  state_->setProperty("role", "heading");
  state_->setWordWrap(true);
  numbers_ = new QLabel(column);
  numbers_->setProperty("role", "muted");

  layout->addStretch(1);
  layout->addWidget(title);
  layout->addLayout(form);
  layout->addLayout(buttons);
  layout->addWidget(state_);
  layout->addWidget(numbers_);
  layout->addWidget(new RecordedSensors(workbench_, column));
  layout->addStretch(2);
  outer->addStretch();
  outer->addWidget(column, 1);
  outer->addStretch();

  connect(kind_, &QComboBox::currentIndexChanged, this, &ConnectPage::onKind);
  connect(refresh_, &QPushButton::clicked, this, &ConnectPage::refreshLines);
  connect(scene_, &QComboBox::activated, this, [this] {
    if (scene_->currentData().toString().isEmpty()) chooseScene();
  });
  connect(connect_, &QPushButton::clicked, this, [this] {
    if (isInUse(workbench_.status())) {
      workbench_.disconnectDevice();
    } else {
      workbench_.setSetupOfTracker(statedSetup());
      workbench_.connectDevice(deviceText(), scenePath());
    }
  });
  connect(next_, &QPushButton::clicked, this, [this] {
    workbench_.goToPage(workbench_.sessionIsOpen() ? QStringLiteral("acquire") : QStringLiteral("plan"));
  });
  connect(save_, &QPushButton::clicked, &workbench_, &Workbench::saveTrace);
  connect(&workbench_, &Workbench::statusChanged, this, &ConnectPage::onStatus);
  onKind();
  onStatus(workbench_.status());
}

ConnectPage::~ConnectPage() {
  stopFinding();
  search_thread_.quit();
  search_thread_.wait();
}

void ConnectPage::makeFinder() {
  find_ = new QPushButton(tr("Find my tracker"), this);
  find_->setObjectName(QStringLiteral("findButton"));
  find_->setToolTip(
      tr("Listens on every serial line, then asks. A tracker that sends is stopped; the guide says what else "
         "may happen to it."));
  found_ = new QListWidget(this);
  found_->setObjectName(QStringLiteral("foundTrackers"));
  found_->setAccessibleName(tr("Trackers found"));
  found_->setWordWrap(true);
  found_->setMaximumHeight(fontMetrics().lineSpacing() * 7);
  found_->hide();
  search_thread_.setObjectName(QStringLiteral("search"));
  connect(find_, &QPushButton::clicked, this, [this] { search_ ? stopFinding() : find(); });
  connect(found_, &QListWidget::itemClicked, this, &ConnectPage::use);
  connect(found_, &QListWidget::itemActivated, this, &ConnectPage::use);
}

void ConnectPage::find() {
  std::vector<std::string> lines;
  const acquisition::DeviceKind& kind = acquisition::deviceKinds()[static_cast<std::size_t>(kind_->currentIndex())];
  const std::string typed = address_->currentText().section(QLatin1Char(','), 0, 0).trimmed().toStdString();
  if (kind.probe && !typed.empty()) {
    lines.push_back(kind.usual_addresses.empty() ? typed.substr(0, typed.rfind('@')) : "tcp:" + typed);
  }
  found_->clear();
  found_->show();
  find_->setText(tr("Stop searching"));
  // The search has the lines.
  connect_->setEnabled(false);
  search_ = new acquisition::TrackerSearch(lines, true);
  search_->moveToThread(&search_thread_);
  connect(search_, &acquisition::TrackerSearch::lineDone, this, &ConnectPage::onLineDone);
  connect(search_, &acquisition::TrackerSearch::finished, this, &ConnectPage::onFound);
  connect(&search_thread_, &QThread::finished, search_, &QObject::deleteLater);
  if (!search_thread_.isRunning()) search_thread_.start();
  QMetaObject::invokeMethod(search_, &acquisition::TrackerSearch::start);
}

void ConnectPage::stopFinding() {
  if (search_) QMetaObject::invokeMethod(search_, &acquisition::TrackerSearch::stop);
}

void ConnectPage::onLineDone(const acquisition::LineFinding& finding) {
  QString text = QString::fromStdString(finding.tracker ? finding.tracker->device : finding.line) +
                 QStringLiteral(": ") + QString::fromStdString(finding.text);
  if (!finding.note.empty()) text += QLatin1Char(' ') + QString::fromStdString(finding.note);
  auto* item = new QListWidgetItem(text, found_);
  if (finding.tracker) {
    item->setData(Qt::UserRole, QString::fromStdString(finding.tracker->device));
    item->setToolTip(tr("Use this tracker"));
  } else {
    item->setFlags(Qt::NoItemFlags);
  }
}

void ConnectPage::onFound() {
  search_->deleteLater();
  search_ = nullptr;
  find_->setText(tr("Find my tracker"));
  connect_->setEnabled(true);
  const QListWidgetItem* only = nullptr;
  int trackers = 0;
  for (int row = 0; row < found_->count(); ++row) {
    if (found_->item(row)->data(Qt::UserRole).isNull()) continue;
    only = found_->item(row);
    ++trackers;
  }
  if (trackers == 1) use(only);
  if (found_->count() > 0) return;
  auto* none =
      new QListWidgetItem(tr("This computer has no serial line. Plug the adapter in, or type tcp:host:port."), found_);
  none->setFlags(Qt::NoItemFlags);
}

void ConnectPage::use(const QListWidgetItem* item) {
  const auto device = acquisition::parseDevice(item->data(Qt::UserRole).toString().toStdString());
  if (!device || !kind_->isEnabled()) return;
  const int index = kind_->findData(QString::fromStdString(device->kind));
  if (index < 0) return;
  kind_->setCurrentIndex(index);
  address_->setCurrentText(QString::fromStdString(device->address));
}

QWidget* ConnectPage::makeSetup() {
  auto* fields = new QWidget(this);
  auto* form = new QFormLayout(fields);
  form->setContentsMargins(0, 0, 0, 0);
  for (const SetupFact& fact : setupFacts()) {
    if (!fact.is_asked) continue;
    const QString key = QString::fromLatin1(fact.file_key.data(), static_cast<qsizetype>(fact.file_key.size()));
    const QString label = QString::fromLatin1(fact.label.data(), static_cast<qsizetype>(fact.label.size()));
    auto* field = new QLineEdit(QSettings().value(key).toString(), fields);
    field->setObjectName(key);
    field->setAccessibleName(label);
    field->setPlaceholderText(tr("not known"));
    field->setToolTip(tr("Kept with every session and calibration; leave it empty if you do not know it."));
    form->addRow(label.left(1).toUpper() + label.mid(1), field);
    setup_facts_.push_back(field);
    connect(field, &QLineEdit::editingFinished, this, [this, field, key] {
      QSettings().setValue(key, field->text().trimmed());
      // A field that is hidden loses the focus: nothing is taken back by that.
      if (!isSimulated()) workbench_.setSetup(statedSetup());
    });
  }
  return fields;
}

bool ConnectPage::isSimulated() const { return kind_->currentIndex() == 0; }

Setup ConnectPage::statedSetup() const {
  Setup setup;
  if (isSimulated()) return setup;
  std::size_t next = 0;
  for (const SetupFact& fact : setupFacts()) {
    if (!fact.is_asked) continue;
    const auto stated = state(setup, fact.key, setup_facts_[next]->text().toStdString());
    FT_CHECK(stated.has_value());
    ++next;
  }
  return setup;
}

void ConnectPage::onKind() {
  const acquisition::DeviceKind& kind = acquisition::deviceKinds()[static_cast<std::size_t>(kind_->currentIndex())];
  const bool simulated = isSimulated();
  kind_help_->setText(simulated ? tr("A simulated tracker in a simulated room; a virtual operator carries the jig.")
                                : QString::fromStdString(kind.address_help));
  for (QWidget* widget :
       {static_cast<QWidget*>(address_label_), static_cast<QWidget*>(address_), static_cast<QWidget*>(refresh_)})
    widget->setVisible(!simulated);
  // A simulated room has no serial numbers, and says which room it is.
  setup_label_->setVisible(!simulated);
  setup_->setVisible(!simulated);
  scene_label_->setVisible(simulated);
  scene_->setVisible(simulated);
  settings_->setSettings(kind.settings);
  if (!simulated) refreshLines();
}

void ConnectPage::refreshLines() {
  const acquisition::DeviceKind& kind = acquisition::deviceKinds()[static_cast<std::size_t>(kind_->currentIndex())];
  // Of another kind's addresses none is of use.
  const QString typed = address_->findText(address_->currentText()) < 0 ? address_->currentText() : QString();
  address_->clear();
  for (const std::string& usual : kind.usual_addresses) address_->addItem(QString::fromStdString(usual));
  const bool is_on_a_line = kind.stream && kind.usual_addresses.empty();
  for (const acquisition::SerialLine& line :
       is_on_a_line ? acquisition::serialLines() : std::vector<acquisition::SerialLine>()) {
    address_->addItem(QString::fromStdString(line.path));
    address_->setItemData(address_->count() - 1, QString::fromStdString(line.description), Qt::ToolTipRole);
  }
  if (!typed.isEmpty()) address_->setCurrentText(typed);
  if (address_->count() == 0)
    address_->lineEdit()->setPlaceholderText(kind.stream ? tr("no serial line found; type a path or tcp:host:port")
                                                         : tr("type the path of the file"));
}

QString ConnectPage::deviceText() const {
  const acquisition::DeviceKind& kind = acquisition::deviceKinds()[static_cast<std::size_t>(kind_->currentIndex())];
  const QString settings = changedSettings(kind.settings, settings_->values());
  // Settings follow an address behind a comma; the simulated tracker has none.
  const bool simulated = isSimulated();
  QString text = QString::fromStdString(kind.id);
  if (!simulated) {
    // The whole of what the command line takes may stand there too.
    const QString address = address_->currentText().trimmed(), prefix = text + QLatin1Char(':');
    text = address.startsWith(prefix) ? address : prefix + address;
  }
  if (!settings.isEmpty()) text += QLatin1Char(simulated ? ':' : ',') + settings;
  return text;
}

void ConnectPage::chooseScene() {
  const QString path = QFileDialog::getOpenFileName(this, tr("Choose a scene"), QString(), tr("Scenes (*.scene.json)"));
  if (path.isEmpty()) {
    scene_->setCurrentIndex(0);
    return;
  }
  scene_->insertItem(0, QFileInfo(path).fileName(), path);
  scene_->setCurrentIndex(0);
}

QString ConnectPage::scenePath() const {
  const QString chosen = scene_->currentData().toString();
  if (!isSimulated() || chosen.isEmpty()) return {};
  return chosen.contains(QLatin1Char('/')) ? chosen : Workbench::builtInScene(chosen);
}

void ConnectPage::onStatus(const acquisition::AcquisitionStatus& status) {
  const bool in_use = isInUse(status);
  const bool running = status.device == acquisition::DeviceState::kRunning;
  connect_->setText(running               ? tr("Disconnect")
                    : status.reconnecting ? tr("Stop reconnecting")
                    : in_use              ? tr("Stop connecting")
                                          : tr("Connect"));
  for (QWidget* widget : {static_cast<QWidget*>(kind_), static_cast<QWidget*>(address_), static_cast<QWidget*>(scene_),
                          static_cast<QWidget*>(settings_)})
    widget->setEnabled(!in_use);
  // A line that is connected is not asked who it is.
  find_->setEnabled(search_ || !in_use);
  next_->setEnabled(running);
  save_->setEnabled(status.has_trace);
  state_->setText(status.device == acquisition::DeviceState::kClosed ? tr("Not connected") : status.device_text);
  if (running && status.live) {
    numbers_->setText(tr("%1 Hz    SD now %2    from the transmitter: %3")
                          .arg(status.rate_hz, 0, 'f', 0)
                          .arg(millimetreText(status.sd_m), positionText(status.live->tracker_from_sensor.position_m)));
  } else {
    numbers_->clear();
  }
}

}  // namespace fieldtrue::widgets
